"""One call for a control step is, bit for bit, a call of `mjx.step` per physics step.

On Warp's CPU device; on a GPU it adds up contact forces in no particular order.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.physics import warp_call
from envs.physics.mjx import MjxPhysics
from envs.physics.quiet_mjx import WARP_INSTALLED

pytestmark = [
    pytest.mark.skipif(not WARP_INSTALLED, reason="needs warp-lang"),
    pytest.mark.skipif(jax.default_backend() != "cpu", reason="compares bits"),
]
STEPS = 120
WORLDS, SUBSTEPS = 3, 4


def make_step(mj_model, calls, substeps=SUBSTEPS, **room):
    physics = MjxPhysics(
        mj_model, substeps, "warp", num_worlds=WORLDS, calls=calls, **room
    )
    return jax.jit(jax.vmap(physics.step))


@pytest.fixture(scope="module")
def whole_step(mj_model):
    return make_step(mj_model, "control_step")


@pytest.fixture(scope="module")
def substep_step(mj_model):
    return make_step(mj_model, "substep")


@pytest.fixture
def many_controls(mj_model, rng):
    shape = (STEPS, WORLDS, SUBSTEPS, mj_model.nu)
    return rng.normal(0, 0.5, shape).astype(np.float32)


def with_restarts(step, fields, state, controls):
    """Outputs of an eventful run: worlds diverge, and begin again in the next step."""
    outputs, begin = [], jax.tree.map(jnp.asarray, state)
    state = begin
    for k, control in enumerate(controls):
        if k % 10 == 5:
            poison = (np.nan, np.inf, 1e11)[k // 10 % 3]
            state = state.replace(qvel=state.qvel.at[k // 10 % 2, 3].set(poison))
        output = step(fields, state, control)
        outputs.append(output)
        lost = jnp.isnan(output.state.qpos).any(axis=1)[:, None]
        again = lost | (k % 40 == 39)
        state = jax.tree.map(
            lambda new, old, where=again: jnp.where(where, new, old),
            begin,
            output.state,
        )
    return jax.tree.map(lambda *x: np.stack(x), *outputs)


def same_bits(a, b):
    pairs = zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True)
    return all(
        np.array_equal(np.asarray(x).view(np.int32), np.asarray(y).view(np.int32))
        for x, y in pairs
    )


def test_a_call_is_its_substeps(fields, start, many_controls, whole_step, substep_step):
    whole = with_restarts(whole_step, fields, start, many_controls)
    single = with_restarts(substep_step, fields, start, many_controls)
    assert same_bits(whole, single)
    assert np.isnan(whole.state.qpos).any(axis=(1, 2)).sum() == STEPS // 10
    assert np.isfinite(whole.state.qpos[:, 2]).all()

    other = {**fields, "geom_friction": np.roll(fields["geom_friction"], 1, axis=0)}
    whole = with_restarts(whole_step, other, start, many_controls)
    assert not same_bits(whole, single)


def test_the_solver_is_as_exact_as_that_of_mjx(
    mj_model, fields, start, many_controls, roll, substep_step
):
    """Warp itself would stop at a tolerance of 1e-6 where the model asks for less."""
    loose = mj_model.__copy__()
    loose.opt.tolerance = 1e-6
    step = make_step(loose, "control_step")
    run = (fields, start, many_controls[:20])
    assert not same_bits(roll(step, *run), roll(substep_step, *run))


@pytest.mark.parametrize("small", ["contacts_per_world", "constraints_per_world"])
def test_lost_contacts_are_reported_alike(
    small, mj_model, fields, start, controls, roll
):
    whole, single = (
        roll(make_step(mj_model, calls, **{small: 1}), fields, start, controls)
        for calls in ("control_step", "substep")
    )
    assert whole.overflow.any()
    np.testing.assert_array_equal(whole.overflow, single.overflow)


def test_batches_of_other_sizes(mj_model, fields, start, controls, whole_step):
    physics = MjxPhysics(mj_model, SUBSTEPS, "warp", num_worlds=WORLDS)
    all_of_them = whole_step(fields, start, controls[0])
    given = (fields, start, controls[0])
    two = whole_step(*jax.tree.map(lambda x: x[:2], given))
    assert same_bits(two, jax.tree.map(lambda x: x[:2], all_of_them))
    alone = jax.jit(physics.step)(*jax.tree.map(lambda x: x[1], given))
    assert same_bits(alone, jax.tree.map(lambda x: x[1], all_of_them))
    # Learners times worlds, with the same fields for each learner.
    nested = jax.jit(jax.vmap(jax.vmap(physics.step), in_axes=(None, 0, 0)))
    twice = jax.tree.map(lambda x: np.stack([x, x[::-1]]), (start, controls[0]))
    learners = nested(fields, *twice)
    assert same_bits(jax.tree.map(lambda x: x[0], learners), all_of_them)
    swapped = whole_step(fields, *jax.tree.map(lambda x: x[::-1], (start, controls[0])))
    assert same_bits(jax.tree.map(lambda x: x[1], learners), swapped)


def test_four_calls_of_a_substep_are_one_of_four(
    mj_model, fields, start, controls, whole_step
):
    """A drive of several rounds has each physics step in a call of its own."""
    round_step, state = make_step(mj_model, "control_step", 1), start
    for k in range(SUBSTEPS):
        output = round_step(fields, state, controls[0][:, k : k + 1])
        state = output.state
    assert same_bits(output, whole_step(fields, start, controls[0]))


def test_nothing_stays_from_a_step_before(
    fields, start, controls, roll, whole_step, monkeypatch
):
    """What diverged worlds leave behind in the solver's rows is gone."""
    lying = jax.tree.map(lambda x: x[-1], roll(whole_step, fields, start, controls))
    found = []

    def spy(*args, of=warp_call.worlds_of):
        found.append(of(*args))
        return found[-1]

    monkeypatch.setattr(warp_call, "worlds_of", spy)
    good = jax.block_until_ready(whole_step(fields, lying.state, controls[0]))
    assert found[-1].data.nefc.numpy().any()
    efc = found[-1].data.efc
    leave = [array for array in vars(efc).values() if array is not None and array.size]
    leave = [array for array in leave if array.dtype.__name__ == "float32"]

    def after_a_divergence():
        for array in leave:
            array.fill_(np.nan)
        return whole_step(fields, lying.state, controls[0])

    assert len(leave) > 5 and same_bits(after_a_divergence(), good)
    monkeypatch.setattr(found[-1], "_begin", lambda: None)
    assert not same_bits(after_a_divergence(), good)
