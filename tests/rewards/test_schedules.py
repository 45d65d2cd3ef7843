import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rewards

YAW = rewards.StepSwitch(before=0.0, after=0.5, at_steps=18_000)
LIFT = rewards.GeometricDecay(
    start=6.25, ratio=0.1, hold_steps=18_000, decay_steps=36_000
)


@jax.jit
def at(schedule, steps):
    return jax.vmap(schedule.__call__)(steps)


def test_yaw_switches_at_its_step():
    found = at(YAW, jnp.array([0, 17_999, 18_000, 10**8]))
    np.testing.assert_array_equal(found, [0.0, 0.0, 0.5, 0.5])


def test_lift_holds_decays_and_holds():
    steps = jnp.array([0, 17_999, 18_000, 36_000, 54_000, 54_001, 10**8])
    expected = [6.25, 6.25, 6.25, 6.25 * 0.1**0.5, 0.625, 0.625, 0.625]
    np.testing.assert_allclose(at(LIFT, steps), expected, rtol=1e-6)


def test_decay_is_continuous_monotone_and_geometric():
    steps = jnp.arange(17_000, 56_000, 10)
    weight = np.asarray(at(LIFT, steps), np.float64)
    ratio = weight[1:] / weight[:-1]
    inside = (np.asarray(steps)[:-1] >= 18_000) & (np.asarray(steps)[1:] <= 54_000)
    np.testing.assert_allclose(ratio[inside], 0.1 ** (10 / 36_000), rtol=1e-6)
    np.testing.assert_array_equal(ratio[~inside], 1.0)


def test_scaling_the_start_scales_the_curve():
    steps = jnp.arange(0, 80_000, 1000)
    for factor in (0.0, 2.0):
        scaled = at(LIFT.replace(start=factor * LIFT.start), steps)
        np.testing.assert_allclose(scaled, factor * at(LIFT, steps), rtol=1e-6)


def test_constant_is_constant():
    found = at(rewards.Constant(-30.0), jnp.arange(0, 10**6, 10**5))
    np.testing.assert_array_equal(found, -30.0)


@pytest.mark.parametrize("schedule", [YAW, LIFT, rewards.Constant(1.5)], ids=str)
def test_python_numbers_do_as_well_as_traced_ones(schedule):
    for steps in (0, 18_000, 30_000):
        traced = at(schedule, jnp.array([steps]))[0]
        assert schedule(steps) == pytest.approx(float(traced), rel=1e-6)
