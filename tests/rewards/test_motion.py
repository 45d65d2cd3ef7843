import jax.numpy as jnp
import numpy as np
import pytest

import rewards


def test_body_motion_splits_into_wanted_and_unwanted_components(rng):
    x, y, z = rng.normal(size=3)
    assert rewards.vertical_velocity(jnp.array([x, y, z])) == pytest.approx(
        z**2, rel=1e-5
    )
    assert rewards.roll_pitch_rate(jnp.array([x, y, z])) == pytest.approx(
        x**2 + y**2, rel=1e-5
    )
    assert rewards.vertical_velocity(jnp.array([x, y, 0.0])) == 0.0
    assert rewards.roll_pitch_rate(jnp.array([0.0, 0.0, z])) == 0.0


def test_regularizers_are_squared_two_norms(rng):
    a, b = rng.normal(size=(2, 20))
    for kernel, arguments, vector in (
        (rewards.torque, (a,), a),
        (rewards.joint_acceleration, (a,), a),
        (rewards.action_rate, (a, b), a - b),
    ):
        value = kernel(*(jnp.asarray(x) for x in arguments))
        assert value == pytest.approx(np.linalg.norm(vector) ** 2, rel=1e-5)


def test_constant_action_has_no_rate(rng):
    action = jnp.asarray(rng.normal(size=20))
    assert rewards.action_rate(action, action) == 0.0
