import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import rewards

DOWN_W = np.array([0.0, 0.0, -1.0])


def test_value_is_the_squared_sine_of_the_tilt_at_every_heading(rng):
    for _ in range(8):
        tilt, axis, heading = rng.uniform(0.0, 2.0 * np.pi, 3)
        lean = Rotation.from_rotvec(tilt * np.array([np.cos(axis), np.sin(axis), 0.0]))
        for turn in (0.0, heading):
            frame_v = Rotation.from_euler("z", turn) * lean
            gravity_v = frame_v.inv().apply(DOWN_W)
            value = rewards.flat_orientation(jnp.asarray(gravity_v))
            assert value == pytest.approx(np.sin(tilt) ** 2, abs=1e-6)


def test_level_costs_nothing():
    assert rewards.flat_orientation(jnp.asarray(DOWN_W)) == 0.0
