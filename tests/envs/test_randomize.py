import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.config.typed import override
from envs.hand.hand_file import load_hand_file
from envs.hand.model import build_model
from envs.hand.spec import hand_spec
from envs.randomize import (
    RandomizeConfig,
    draw_variation,
    model_fields,
    no_randomization,
)

HAND = load_hand_file()
MODEL = build_model(HAND)
SPEC = hand_spec(MODEL)
KEY = jax.random.key(20260111)
NOMINAL = draw_variation(KEY, no_randomization(HAND.tip_friction.value), 20)
LOADED = {"payload_mass_scale": (0.5, 1.0)}


@pytest.fixture(scope="module")
def draws():
    print("seed 20260111")
    keys, config = jax.random.split(KEY, 4000), RandomizeConfig(**LOADED)
    return jax.vmap(lambda key: draw_variation(key, config, 20))(keys)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("tip_friction", 0.30, 1.30),
        ("stiffness_scale", 0.78, 1.22),
        ("damping_scale", 0.78, 1.22),
        ("effort_scale", 1.0, 1.5),
        ("payload_com_m", [-0.015, -0.010, -0.010], [0.015, 0.010, 0.010]),
        ("payload_mass_scale", 0.5, 1.0),
        ("palm_mass_scale", 0.9, 1.1),
        ("palm_com_m", -0.005, 0.005),
        ("imu_rotation_rad", -0.03, 0.03),
        ("gyro_bias_rps", -0.05, 0.05),
    ],
)
def test_draws_fill_their_ranges(draws, name, low, high):
    """Of 4,000 uniform draws the extremes lie within 0.5 % of the ends (1 - 2e-9)."""
    values, low, high = np.asarray(getattr(draws, name)), np.array(low), np.array(high)
    width = high - low
    assert (values >= low - 1e-6).all() and (values <= high + 1e-6).all()
    assert (values.min(axis=0) < low + 0.005 * width).all()
    assert (values.max(axis=0) > high - 0.005 * width).all()
    np.testing.assert_allclose(
        values.mean(axis=0), (low + high) / 2, atol=0.03 * np.max(width)
    )


def test_quantities_are_drawn_independently(draws):
    columns = [np.asarray(x).reshape(4000, -1) for x in jax.tree.leaves(draws)]
    correlation = np.corrcoef(np.concatenate(columns, axis=1).T)
    off_diagonal = correlation - np.eye(len(correlation))
    assert np.abs(off_diagonal).max() < 6 / np.sqrt(4000)


WIDER = {
    "tip_friction": {"tip_friction": (0.1, 2.0)},
    "effort_scale": {"effort_scale": (0.5, 2.0)},
    "payload_com_m": {"payload_com_m": (0.02, 0.03)},
    "payload_mass_scale": LOADED,
    "palm_mass_scale": {"palm_mass_scale": (0.5, 2.0)},
    "palm_com_m": {"palm_com_m": 0.01},
    "imu_rotation_rad": {"imu_tilt_rad": 0.1},
    "gyro_bias_rps": {"gyro_bias_rps": 0.1},
}


@pytest.mark.parametrize("name", WIDER)
def test_another_range_moves_no_other_draw(name):
    config = dataclasses.replace(RandomizeConfig(), **WIDER[name])
    before = vars(draw_variation(KEY, RandomizeConfig(), 20))
    after = vars(draw_variation(KEY, config, 20))
    moved = {k for k in before if not np.array_equal(before[k], after[k])}
    assert moved == {name}


def test_without_randomization_the_model_is_the_nominal_one():
    for name, value in model_fields(MODEL, SPEC, NOMINAL).items():
        np.testing.assert_allclose(value, getattr(MODEL, name), rtol=1e-6, err_msg=name)


RANGES = np.linspace(0.8, 1.2, 20)


@pytest.mark.parametrize(
    ("changes", "assignments"),
    [
        ({"tip_friction": 0.35}, ["tip_friction.low=null", "tip_friction.value=0.35"]),
        ({"payload_mass_scale": 0.25}, ["payload_mass.value=0.02"]),
        ({"palm_mass_scale": 1.1}, [f"palm_mass.value={1.1 * HAND.palm_mass.value}"]),
        (
            {"palm_com_m": [0.001, -0.002, 0.003]},
            ["palm_com_offset.value=[1e-3,-2e-3,3e-3]"],
        ),
        (
            {"stiffness_scale": RANGES},
            [f"stiffness_scale.value={[float(x) for x in 18.7 * RANGES]}"],
        ),
        (
            {"damping_scale": RANGES},
            [f"damping_scale.value={[float(x) for x in 4.3243497 * RANGES]}"],
        ),
        ({"effort_scale": 1.3}, ["torque_scale.value=1.3"]),
    ],
)
def test_a_varied_model_is_that_of_a_hand_file_with_the_same_values(
    changes, assignments
):
    variation = NOMINAL.replace(**{k: jnp.asarray(v) for k, v in changes.items()})
    free = ["stiffness_scale.low=null", "stiffness_scale.high=null"]
    other = build_model(override(HAND, free + assignments))
    differs = False
    for name, value in model_fields(MODEL, SPEC, variation).items():
        expected = getattr(other, name)
        np.testing.assert_allclose(value, expected, rtol=1e-5, atol=1e-9, err_msg=name)
        differs |= not np.allclose(expected, getattr(MODEL, name), rtol=1e-4)
    assert differs


def one_changed_per_world(state, changes):
    """World 0's state in all worlds; world i + 1 has the i-th change of its draw."""
    state = jax.tree.map(lambda x: jnp.broadcast_to(x[:1], x.shape), state)
    draw = state.memory.world.variation
    nominal = jax.tree.map(lambda x, y: jnp.zeros_like(x) + y, draw, NOMINAL)
    for index, (name, value) in enumerate(changes.items(), start=1):
        changed = getattr(nominal, name).at[index].set(jnp.asarray(value))
        nominal = nominal.replace(**{name: changed})
    world = state.memory.world.replace(variation=nominal)
    return state.replace(memory=state.memory.replace(world=world))


def test_each_quantity_reaches_the_physics_of_its_world_only(crawl):
    changes = {
        "tip_friction": 0.3,
        "stiffness_scale": 0.78,
        "damping_scale": 1.22,
        "effort_scale": 0.1,
        "payload_com_m": [0.0, 0.010, 0.0],
        "palm_mass_scale": 1.5,
        "palm_com_m": [0.0, 0.0, 0.005],
    }
    state = one_changed_per_world(crawl.first, changes)
    actions = np.repeat(crawl.actions(12)[:, :1], 8, axis=1)
    after = crawl.roll(state, actions)[-1]
    assert not np.asarray(after.done).any()
    for index, name in enumerate(changes, start=1):
        moved = np.abs(after.data.qpos[index] - after.data.qpos[0]).max()
        assert moved > 1e-5, name
    # The palm of 0.389 kg carries half as much again, and the drives a tenth.
    force = np.asarray(after.signals.tip_force_n).sum(axis=1)
    assert force[6] > 1.1 * force[0]
    limit = MODEL.actuator_forcerange[:, 1]
    torque = np.abs(np.asarray(after.signals.torque_nm))
    assert (torque[4] <= 0.1 * limit + 1e-6).all() and (torque[0] > 0.1 * limit).any()


def test_sensor_errors_reach_the_observation_and_not_the_physics(crawl, differing):
    changes = {"imu_rotation_rad": [0.03, 0.0, 0.0], "gyro_bias_rps": [0.05, 0.0, 0.0]}
    state = one_changed_per_world(crawl.first, changes)
    actions = np.repeat(crawl.actions(3)[:, :1], 8, axis=1)
    after = crawl.roll(state, actions)[-1]
    assert differing(after.data, after.data, 0, 1) == []
    assert differing(after.data, after.data, 0, 2) == []
    assert differing(after, after, 0, 3) == []  # nothing was changed in world 3
    actor = np.asarray(after.obs["state"])
    gravity, gyro = slice(181, 184), slice(205, 208)  # the newest samples
    assert np.abs(actor[1, gravity] - actor[0, gravity]).max() > 0.01
    np.testing.assert_array_equal(actor[2, gravity], actor[0, gravity])
    bias = actor[2, gyro] - actor[0, gyro]
    np.testing.assert_allclose(bias, [0.05, 0.0, 0.0], atol=1e-6)
