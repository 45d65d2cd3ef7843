import jax.numpy as jnp
import numpy as np

import rewards


def test_contact_begins_at_the_threshold():
    force = jnp.array([0.0, np.nextafter(0.15, 0.0, dtype=np.float32), 0.15, 1.0])
    touching = rewards.in_contact(force, 0.15)
    np.testing.assert_array_equal(touching, [False, False, True, True])


def test_command_counts_from_the_dead_speed_in_every_direction(rng):
    angle = rng.uniform(0.0, 2.0 * np.pi, size=16)
    for direction in np.stack([np.cos(angle), np.sin(angle)], axis=-1):
        assert rewards.is_commanded(jnp.asarray(0.0201 * direction), 0.02)
        assert not rewards.is_commanded(jnp.asarray(0.0199 * direction), 0.02)
    assert rewards.is_commanded(jnp.array([0.02, 0.0]), 0.02)
    assert not rewards.is_commanded(jnp.zeros(2), 0.02)
