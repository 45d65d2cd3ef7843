import functools
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rewards

DT_S = 0.02
SHAPES = {
    "vel_v": (3,),
    "angvel_v": (3,),
    "command": (3,),
    "tip_pos_v": (5, 3),
    "footprint_target_v": (5, 3),
    "tip_vel_v": (5, 3),
    "tip_force_n": (5,),
    "lift_magnitude": (),
    "air_time_magnitude": (),
    "gravity_v": (3,),
    "link_contact": (15,),
    "action": (20,),
    "previous_action": (20,),
    "torque_nm": (20,),
    "joint_acc": (20,),
}
TABLES = {"crawl": rewards.CRAWL, "stock": rewards.STOCK}


def draw_signals(rng, batch=()):
    return {
        name: jnp.asarray(rng.normal(size=batch + shape), jnp.float32)
        for name, shape in SHAPES.items()
    }


def reward(table, weights, signals, steps):
    return rewards.evaluate(table, signals, rewards.weights_at(weights, steps), DT_S)


@pytest.fixture(params=TABLES)
def table(request):
    return TABLES[request.param]


def summed(terms):
    total = np.float32(0.0)
    for term in terms:
        total = total + np.asarray(term)
    return total


def test_terms_add_up_to_the_reward_to_the_last_bit(table, rng):
    signals, weights = draw_signals(rng, (4096,)), rewards.table_weights(table)
    batched = jax.vmap(functools.partial(reward, table), in_axes=(None, 0, None))
    total, terms = jax.jit(batched)(weights, signals, 20_000)
    assert list(terms) == sorted(row.name for row in table)
    np.testing.assert_array_equal(total, summed(terms.values()))
    assert (np.asarray(total) != summed(reversed(terms.values()))).any()
    eager_signals = draw_signals(rng)
    total, terms = reward(table, weights, eager_signals, 20_000)
    assert total == summed(terms.values())
    assert total == reward(table[::-1], weights, eager_signals, 20_000)[0]


def test_terms_are_weight_times_magnitude_times_interval(table, rng):
    signals, steps = draw_signals(rng), 30_000
    weights = rewards.weights_at(rewards.table_weights(table), steps)
    _, terms = rewards.evaluate(table, signals, weights, DT_S)
    for row in table:
        magnitude = row.kernel(*(signals[name] for name in row.signals))
        expected = float(weights[row.name]) * float(magnitude) * DT_S
        assert terms[row.name] == pytest.approx(expected, rel=1e-5, abs=1e-9)


def test_changing_or_sweeping_weights_does_not_compile_again(rng):
    traces = []

    @jax.jit
    def compiled(weights, signals, steps):
        traces.append(None)
        return reward(rewards.CRAWL, weights, signals, steps)[0]

    signals, steps = draw_signals(rng), jnp.asarray(20_000)
    before = compiled(rewards.table_weights(rewards.CRAWL), signals, steps)
    slower = rewards.GeometricDecay(12.5, 0.2, 9_000, 72_000)
    changed = rewards.table_weights(
        rewards.CRAWL, {"footprint": -60.0, "lift": slower, "torque": 0}
    )
    assert compiled(changed, signals, steps + 1) != before
    assert len(traces) == 1
    compiled(changed | {"lift": rewards.Constant(jnp.ones(()))}, signals, steps)
    assert len(traces) == 2  # another kind of schedule is another program


def test_weights_can_be_swept(rng):
    signals = draw_signals(rng)
    weights = rewards.table_weights(rewards.CRAWL)
    scales = jnp.array([0.0, 1.0, 3.3])
    swept = weights | {"footprint": rewards.Constant(-30.0 * scales)}
    axes = dict.fromkeys(weights) | {"footprint": rewards.Constant(0)}
    sweep = jax.vmap(lambda w: reward(rewards.CRAWL, w, signals, 0), in_axes=(axes,))
    total, terms = jax.jit(sweep)(swept)
    assert total.shape == (3,)
    expected = np.asarray(scales) * np.asarray(terms["footprint"][1])
    np.testing.assert_allclose(terms["footprint"], expected, rtol=1e-6)


def test_signals_may_be_a_dataclass(rng):
    @dataclass(frozen=True)
    class Hand:
        vel_v: jax.Array
        command: jax.Array

    table = rewards.CRAWL[:1]
    signals = draw_signals(rng)
    weights = rewards.weights_at(rewards.table_weights(table), 0)
    hand = Hand(signals["vel_v"], signals["command"])
    assert rewards.evaluate(table, hand, weights, DT_S) == rewards.evaluate(
        table, signals, weights, DT_S
    )


def test_non_finite_terms_are_not_hidden(rng):
    signals = draw_signals(rng) | {"torque_nm": jnp.full(20, jnp.nan)}
    weights = rewards.table_weights(rewards.CRAWL)
    total, terms = reward(rewards.CRAWL, weights, signals, 0)
    assert np.isnan(total)
    assert [name for name, term in terms.items() if np.isnan(term)] == ["torque"]


def test_gradient_flows_through_the_table(rng):
    signals, weights = draw_signals(rng), rewards.table_weights(rewards.CRAWL)
    gradient = jax.jit(jax.grad(lambda s: reward(rewards.CRAWL, weights, s, 0)[0]))(
        signals
    )
    assert all(np.isfinite(g).all() for g in gradient.values())
    np.testing.assert_allclose(
        gradient["torque_nm"], -2.5e-5 * DT_S * 2.0 * signals["torque_nm"], rtol=1e-5
    )


def test_empty_table_pays_nothing():
    total, terms = rewards.evaluate((), {}, {}, DT_S)
    assert total == 0.0
    assert terms == {}


def test_duplicate_rows_are_refused():
    twice = rewards.CRAWL + rewards.CRAWL[2:3]
    with pytest.raises(ValueError, match=r"duplicate reward terms: footprint; valid:"):
        rewards.table_weights(twice)


def test_unknown_signal_is_named_with_the_valid_ones(rng):
    row = rewards.RewardTerm("wobble", rewards.vertical_velocity, 1.0, ("vel_x",))
    signals = {"vel_v": jnp.zeros(3), "command": jnp.zeros(3)}
    with pytest.raises(ValueError, match=r"'wobble' .* vel_x; valid: vel_v, command"):
        rewards.evaluate((row,), signals, {"wobble": 1.0}, DT_S)


def test_unknown_and_missing_weights_are_named():
    table = rewards.CRAWL[:2]
    valid = "track_planar_velocity, track_yaw_rate"
    with pytest.raises(ValueError, match=f"unknown reward terms: foot; valid: {valid}"):
        rewards.table_weights(table, {"foot": 1.0})
    with pytest.raises(ValueError, match="no weight for reward terms: track_yaw_rate"):
        rewards.evaluate(table, {}, {"track_planar_velocity": 1.0}, DT_S)
