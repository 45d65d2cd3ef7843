"""Advantages against Brax's, and that Brax's loss takes them."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brax.training.agents.ppo import losses

from fingers_mjx.ppo import brax
from fingers_mjx.ppo.config import PpoConfig
from fingers_mjx.ppo.scalars import scalars_of

T, B = 24, 7


def rollout(seed: int, t: int = T) -> dict[str, Any]:
    """Random rewards and values with ends and truncations."""
    rng = np.random.default_rng(seed)
    ends = rng.random((t, B)) < 0.1
    cut = ends & (rng.random((t, B)) < 0.5)
    return {
        "truncation": jnp.array(cut, jnp.float32),
        "termination": jnp.array(ends & ~cut, jnp.float32),
        "rewards": jnp.array(rng.normal(size=(t, B)), jnp.float32),
        "values": jnp.array(rng.normal(size=(t, B)), jnp.float32),
        "bootstrap_value": jnp.array(rng.normal(size=B), jnp.float32),
        "lambda_": 0.95,
        "discount": 0.99,
    }


@pytest.mark.parametrize("t", [1, 5, T, 200])
def test_targets_and_advantages_are_those_of_brax(t: int):
    given = rollout(t, t)
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


def test_the_loss_takes_them_and_brax_keeps_its_own(monkeypatch):
    class Asked(Exception):
        pass

    def asked(**given):
        raise Asked(*given)

    monkeypatch.setitem(brax._compute_ppo_loss.__globals__, "compute_gae", asked)
    config = PpoConfig(actor_layers=(4,), critic_layers=(4,))
    nets = brax.make_networks({"state": 3, "privileged_state": 3}, 2, config)
    params = brax.PPONetworkParams(
        policy=nets.policy_network.init(jax.random.key(0)),
        value=nets.value_network.init(jax.random.key(1)),
    )
    size = {"state": 3, "privileged_state": 3}
    data = brax.Transition(
        observation={k: jnp.zeros((B, T, n)) for k, n in size.items()},
        action=jnp.zeros((B, T, 2)),
        reward=jnp.zeros((B, T)),
        discount=jnp.ones((B, T)),
        next_observation={"privileged_state": jnp.zeros((B, 1, 3))},
        extras={
            "state_extras": {"truncation": jnp.zeros((B, T))},
            "policy_extras": {
                "raw_action": jnp.zeros((B, T, 2)),
                "log_prob": jnp.zeros((B, T)),
            },
        },
    )
    normalizer = brax.init_normalizer(size)
    with pytest.raises(Asked) as found:
        brax.brax_loss(nets)(
            params, scalars_of(config), normalizer, data, jax.random.key(2)
        )
    assert set(found.value.args) == set(rollout(0))
    assert losses.compute_ppo_loss.__globals__["compute_gae"] is losses.compute_gae
