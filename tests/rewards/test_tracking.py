import jax.numpy as jnp
import numpy as np
import pytest

import rewards


def test_kernels_read_only_their_own_components(rng):
    vel, angvel, command = (jnp.asarray(x) for x in rng.normal(size=(3, 3)) * 0.1)
    planar = rewards.track_planar_velocity(vel, command)
    assert rewards.track_planar_velocity(vel.at[2].add(9.0), command) == planar
    assert rewards.track_planar_velocity(vel, command.at[2].add(9.0)) == planar
    assert rewards.track_planar_velocity(vel, command.at[1].add(0.1)) != planar
    yaw = rewards.track_yaw_rate(angvel, command)
    assert rewards.track_yaw_rate(angvel.at[:2].add(9.0), command) == yaw
    assert rewards.track_yaw_rate(angvel, command.at[:2].add(9.0)) == yaw
    assert rewards.track_yaw_rate(angvel, command.at[2].add(0.1)) != yaw


def test_default_widths_are_the_papers():
    command = jnp.zeros(3)
    vel = jnp.array([0.06, -0.08, 0.0])
    angvel = jnp.array([0.0, 0.0, -0.225])
    for value in (
        rewards.track_planar_velocity(vel, command),
        rewards.track_yaw_rate(angvel, command),
    ):
        assert value == pytest.approx(np.exp(-1.0), rel=1e-5)


def test_tracking_falls_with_the_error():
    errors = jnp.linspace(0.0, 0.4, 30)
    planar = [
        rewards.track_planar_velocity(jnp.array([e, 0.0, 0.0]), jnp.zeros(3))
        for e in errors
    ]
    assert planar[0] == 1.0
    assert (np.diff(planar) < 0.0).all()
