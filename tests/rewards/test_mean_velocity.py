import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rewards

DT_S = 0.02


@jax.jit
def errors(yaw_rate, command):
    """Mean errors of a palm that turns at these rates and moves at 0.1 m/s."""

    def step(memory, rate):
        vel_v, angvel_v = jnp.array([0.1, 0.0, 9.0]), jnp.array([9.0, 9.0, rate])
        return rewards.mean_error_step(memory, vel_v, angvel_v, command, DT_S)

    return jax.lax.scan(step, rewards.init_mean_error_memory(), yaw_rate)[1]


def test_a_constant_error_is_found_with_the_time_constant():
    found = errors(jnp.full(500, 0.4), jnp.array([0.16, 0.02, -0.1]))
    np.testing.assert_allclose(found[-1], [-0.06, -0.02, 0.5], rtol=1e-4)
    after_tau = found[round(0.5 / DT_S) - 1, 2] / 0.5
    assert after_tau == pytest.approx(1 - np.exp(-1), abs=0.02)


def test_the_sway_of_a_stride_leaves_little():
    time_s = np.arange(1000) * DT_S
    sway = jnp.asarray(0.8 * np.sin(2 * np.pi * 2.0 * time_s))
    left = np.abs(errors(sway, jnp.array([0.1, 0.0, 0.0]))[500:, 2]).max()
    assert left < 0.2 * 0.8
    # without a mean, the kernel of single steps pays the same palm much less
    single = [
        rewards.track_yaw_rate(jnp.array([0.0, 0.0, rate]), jnp.zeros(3))
        for rate in sway[500:550]
    ]
    mean = errors(sway, jnp.array([0.1, 0.0, 0.0]))[500:550]
    paid = [rewards.track_mean_yaw_rate(error) for error in mean]
    assert np.mean(paid) > np.mean(single) + 0.3


@pytest.mark.parametrize(
    ("kernel", "unit"),
    [
        (rewards.track_mean_planar_velocity, [0.06, -0.08, 0.0]),
        (rewards.track_mean_yaw_rate, [0.0, 0.0, -0.225]),
    ],
)
def test_kernels_fall_to_1_over_e_at_their_width_and_keep_a_slope(kernel, unit):
    unit = jnp.array(unit)
    assert kernel(jnp.zeros(3)) == 1.0
    assert kernel(unit) == pytest.approx(np.exp(-1.0), rel=1e-5)
    slope = jax.grad(lambda size: kernel(size * unit))
    assert slope(0.1) == pytest.approx(-np.exp(-0.1), rel=1e-4)
    assert slope(3.0) == pytest.approx(-np.exp(-3.0), rel=1e-4)
    assert np.isfinite(jax.grad(lambda x: kernel(x))(jnp.zeros(3))).all()
