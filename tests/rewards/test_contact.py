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


@pytest.mark.parametrize("friction", [0.25, 1.0])
def test_shear_counts_beyond_the_friction_cone(friction):
    normal = jnp.array([1.0, 2.0, 0.0])
    on_cone = friction * normal
    force = jnp.hypot(normal, on_cone)
    assert rewards.shear_excess(on_cone, force, friction) == pytest.approx(0, abs=1e-6)
    assert rewards.shear_excess(0.5 * on_cone, force, friction) == 0.0
    flat = jnp.array([0.3, 0.0, 0.4])
    held = friction / (1 + friction**2) ** 0.5
    value = rewards.shear_excess(flat, flat, friction)
    assert value == pytest.approx(0.7 * (1 - held), rel=1e-6)
    assert rewards.shear_excess(2 * flat, 2 * flat, friction) == pytest.approx(
        2 * value
    )
