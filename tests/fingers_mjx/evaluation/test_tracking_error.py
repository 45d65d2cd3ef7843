"""Errors of the turn rate and the planar velocity."""

import jax.numpy as jnp
import numpy as np

from fingers_mjx.evaluation.tracking_error import (
    planar_velocity_error_mps,
    turn_rate_error_rad_s,
)

DT = 0.02
ALIVE = jnp.ones(500, bool)


def test_turn_rate_error_ignores_swing_within_strides_but_not_bias():
    time = np.arange(500) * DT
    swing = 0.3 * np.sin(2 * np.pi * 2 * time)
    command = np.full(500, 0.2)
    args = jnp.array(command), ALIVE, DT
    assert turn_rate_error_rad_s(jnp.array(command + swing), *args) < 1e-5
    off = turn_rate_error_rad_s(jnp.array(command + swing - 0.1), *args)
    np.testing.assert_allclose(off, 0.1, rtol=1e-3)
    opposite = jnp.array(np.where(time < 5, 0.1, -0.1) + command)
    assert turn_rate_error_rad_s(opposite, *args) > 0.08  # signs do not cancel


def test_planar_velocity_error_is_the_size_of_what_is_not_asked_for():
    time = np.arange(500) * DT
    command = np.tile([0.1, 0.0, 0.4], (500, 1))
    swing = 0.2 * np.stack([np.sin(2 * np.pi * 2 * time)] * 2, axis=1)
    exact = jnp.array(command[:, :2] + swing)
    args = jnp.array(command), ALIVE, DT
    assert planar_velocity_error_mps(exact, *args) < 1e-5
    for off in ([0.03, 0.04], [-0.05, 0.0]):  # faster and to the side; slower
        found = planar_velocity_error_mps(exact + jnp.array(off), *args)
        np.testing.assert_allclose(found, 0.05, rtol=1e-3)
    opposite = jnp.where(time[:, None] < 5, 0.05, -0.05) + exact
    assert planar_velocity_error_mps(opposite, *args) > 0.06  # signs do not cancel


def test_errors_of_an_episode_shorter_than_the_window_are_not_defined():
    short = jnp.zeros((49, 3))
    assert np.isnan(planar_velocity_error_mps(short[:, :2], short, ALIVE[:49], DT))
    assert np.isnan(turn_rate_error_rad_s(short[:, 0], short[:, 2], ALIVE[:49], DT))


def test_what_follows_a_fall_is_in_no_error():
    velocity = jnp.where(jnp.arange(500)[:, None] < 200, 0.1, jnp.nan) * jnp.ones(2)
    command = jnp.tile(jnp.array([0.1, 0.1, 0.0]), (500, 1))
    found = planar_velocity_error_mps(velocity, command, jnp.arange(500) < 200, DT)
    assert found < 1e-6
