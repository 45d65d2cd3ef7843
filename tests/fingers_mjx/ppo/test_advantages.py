"""Advantages against Brax's, and that Brax's loss takes them."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brax.training.agents.ppo import losses

from fingers_mjx.ppo import brax

T, B = 24, 7


def rollout(seed: int) -> dict[str, Any]:
    """Random rewards and values with ends and truncations."""
    rng = np.random.default_rng(seed)
    ends = rng.random((T, B)) < 0.1
    cut = ends & (rng.random((T, B)) < 0.5)
    return {
        "truncation": jnp.array(cut, jnp.float32),
        "termination": jnp.array(ends & ~cut, jnp.float32),
        "rewards": jnp.array(rng.normal(size=(T, B)), jnp.float32),
        "values": jnp.array(rng.normal(size=(T, B)), jnp.float32),
        "bootstrap_value": jnp.array(rng.normal(size=B), jnp.float32),
        "lambda_": 0.95,
        "discount": 0.99,
    }


@pytest.mark.parametrize("seed", range(3))
def test_targets_and_advantages_are_those_of_brax(seed: int):
    given = rollout(seed)
    for ours, theirs in zip(
        brax._compute_gae(**given), losses.compute_gae(**given), strict=True
    ):
        np.testing.assert_allclose(ours, theirs, rtol=1e-5, atol=1e-5)


def test_a_truncated_step_counts():
    given = rollout(0)
    blind = given | {"truncation": jnp.zeros((T, B))}
    assert jnp.any(given["truncation"] > 0)
    ours, theirs = brax._compute_gae(**blind)[1], losses.compute_gae(**given)[1]
    assert float(jnp.max(jnp.abs(ours - theirs))) > 0.1


def test_no_gradient_passes():
    given = rollout(0)

    def total(values: jax.Array) -> jax.Array:
        targets, advantage = brax._compute_gae(**given | {"values": values})
        return jnp.sum(targets) + jnp.sum(advantage)

    assert not jnp.any(jax.grad(total)(given["values"]))


def test_the_loss_takes_them_and_brax_keeps_its_own():
    assert brax._compute_ppo_loss.__globals__["compute_gae"] is brax._compute_gae
    assert losses.compute_ppo_loss.__globals__["compute_gae"] is losses.compute_gae
    assert "compute_gae" in losses.compute_ppo_loss.__code__.co_names
