import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from envs.physics.base import PhysicsOutput, PhysicsState, nan_if_diverged


def sensor(mj_model, output, name):
    view = mj_model.sensor(name)
    return output.sensordata[..., view.adr[0] : view.adr[0] + view.dim[0]]


def test_jax_and_cpu_are_the_same_physics(
    mj_model, fields, start, controls, roll, jax_step, cpu_step, largest_difference
):
    on_jax = roll(jax_step, fields, start, controls)
    on_cpu = roll(cpu_step, fields, start, controls)

    assert largest_difference(on_jax, on_cpu) < 1
    assert not on_jax.overflow.any() and not on_cpu.overflow.any()
    # The rollout shows what it should: contact, and drives at their limits.
    assert sensor(mj_model, on_cpu, "tip")[..., 0].any()
    limit = fields["actuator_forcerange"][:, 1, 1]
    assert np.isclose(np.abs(sensor(mj_model, on_cpu, "flex")[..., 0]), limit).any()


@pytest.mark.parametrize("name", ["geom_friction", "body_mass", "body_ipos"])
def test_the_comparison_notices_a_different_field(
    name, fields, start, controls, roll, jax_step, cpu_step, largest_difference
):
    # The same values, given to the wrong worlds.
    other = {**fields, name: np.roll(fields[name], 1, axis=0)}
    on_cpu = roll(cpu_step, fields, start, controls)
    for step in (cpu_step, jax_step):
        assert largest_difference(roll(step, other, start, controls), on_cpu) > 10


@pytest.mark.parametrize("backend", ["jax_step", "cpu_step"])
def test_a_diverged_world_is_nan_and_alone(
    backend, fields, start, controls, roll, request
):
    step = request.getfixturevalue(backend)
    good = roll(step, fields, start, controls[:2])
    for poison in (np.nan, 1e11):
        qvel = start.qvel.copy()
        qvel[1, 3] = poison
        bad = roll(step, fields, start.replace(qvel=qvel), controls[:2])
        for x, y in zip(jax.tree.leaves(bad), jax.tree.leaves(good), strict=True):
            np.testing.assert_array_equal(x[:, [0, 2]], y[:, [0, 2]])
        for x in jax.tree.leaves((bad.state, bad.sensordata)):
            assert np.isnan(x[:, 1]).all()


@pytest.mark.parametrize("backend", ["jax_step", "cpu_step"])
def test_nan_control_ends_its_world_only(backend, fields, start, controls, request):
    step = request.getfixturevalue(backend)
    control = controls[0].copy()
    control[2, 1, 0] = np.nan
    output = step(fields, start, control)
    np.testing.assert_array_equal(
        np.isfinite(output.state.qpos).all(axis=1), [True, True, False]
    )


def test_diverged_is_beyond_mjmaxval():
    def output(value):
        state = PhysicsState(jnp.zeros(3), jnp.array([0.0, value]), jnp.zeros(2))
        return nan_if_diverged(PhysicsOutput(state, jnp.ones(4), jnp.int32(5)))

    limit = np.float32(mujoco.mjMAXVAL)
    assert output(-limit).state.qvel[1] == -limit
    assert jnp.isnan(output(np.nextafter(limit, np.inf)).sensordata).all()
    assert output(np.nan).overflow == 5


@pytest.mark.parametrize("backend", ["jax_step", "cpu_step"])
def test_new_values_do_not_recompile(backend, fields, start, controls, request):
    step = request.getfixturevalue(backend)
    fields, start, controls = jax.tree.map(jnp.asarray, (fields, start, controls))
    output = step(fields, start, controls[0])
    compiled = step._cache_size()
    heavy = {**fields, "body_mass": 2 * fields["body_mass"]}
    step(heavy, output.state, controls[1])
    assert step._cache_size() == compiled
