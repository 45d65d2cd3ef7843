import jax.numpy as jnp
import pytest

import rewards


def test_undesired_contact_counts_links(rng):
    touching = rng.random(15) < 0.5
    assert rewards.undesired_contact(jnp.asarray(touching, float)) == touching.sum()


def test_only_tips_in_contact_slide(rng):
    planted = rng.random(5) < 0.5
    velocity = jnp.tile(jnp.array([0.3, -0.4, 7.0]), (5, 1))
    force = jnp.where(jnp.asarray(planted), 0.15, 0.1499)
    value = rewards.foot_slide(velocity, force)
    assert value == pytest.approx(0.5 * planted.sum(), rel=1e-6)
    assert rewards.foot_slide(0.0 * velocity, force) == 0.0
