"""Every array that passes through our functions is checked while the tests run."""

import jax.numpy as jnp
import pytest
from jaxtyping import TypeCheckError

import rewards
from envs import rotations


def test_a_wrong_shape_is_refused():
    """Negative control of the import hook."""
    level = jnp.array([1.0, 0.0, 0.0, 0.0])
    assert rotations.rotate(level, jnp.ones(3)).shape == (3,)
    with pytest.raises(TypeCheckError):
        rotations.rotate(level, jnp.ones(2))
    with pytest.raises(TypeCheckError):
        rewards.track_yaw_rate(jnp.zeros(2), jnp.zeros(3))
