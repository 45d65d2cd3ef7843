"""Updates of the networks on one rollout; an update that is not finite is skipped."""

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Int, PRNGKeyArray

from fingers_mjx.ppo.brax import (
    Transition,
    adapt_learning_rate,
    learning_rate,
    update_normalizer,
    with_learning_rate,
)
from fingers_mjx.ppo.health import finite_terms, note_faults, record, term_names
from fingers_mjx.ppo.rollout import Rollout
from fingers_mjx.ppo.scalars import PpoScalars
from fingers_mjx.ppo.state import Learner, TrainState
from fingers_mjx.ppo.totals import Totals, total

LOSS_TERMS = {
    "policy_loss": "loss/policy",
    "v_loss": "loss/value",
    "entropy_loss": "loss/entropy",
    "kl_mean": "kl",
    "total_loss": "loss/total",
}
"""Brax's name of each watched term of the loss, and ours, the sum last."""


def improve(
    learner: Learner,
    scalars: PpoScalars,
    train: TrainState,
    rollout: Rollout,
    key: PRNGKeyArray,
) -> tuple[TrainState, Totals]:
    """Returns `train` after all updates on `rollout`, and the metrics of the updates.

    In each epoch the worlds are shuffled and dealt to the minibatches; a world's
    whole trajectory stays together. In the first `critic_iterations` the policy's
    gradients reach Adam's moments, but not the policy.
    """
    config, worlds = learner.config, rollout.reward.shape[1]
    key_deal, key_loss = jax.random.split(key)
    deals = jax.vmap(lambda k: jax.random.permutation(k, worlds))(
        jax.random.split(key_deal, config.epochs)
    )
    updates = config.epochs * config.minibatches
    batches = deals.reshape(updates, -1), jax.random.split(key_loss, updates)
    update = functools.partial(_update, learner, scalars, rollout)
    train = _policy_begins(train, scalars)
    train, totals = jax.lax.scan(update, train, batches)
    train = dataclasses.replace(
        train,
        normalizer=update_normalizer(train.normalizer, rollout.obs, rollout.valid),
        health=note_faults(train.health, rollout.fault, train.iteration),
        iteration=train.iteration + 1,
    )
    return train, jax.tree.map(lambda x: jnp.sum(x, axis=0), totals)


def watched(params: Any, terms: Mapping[str, Any], gradient: Any) -> dict[str, Any]:
    """Groups what must be finite for an update, in the order of suspicion."""
    losses = {name: terms[key] for key, name in LOSS_TERMS.items()}
    return {"params": params, **losses, "gradient": gradient}


def watched_names(params: Any) -> list[str]:
    """Returns the names of all that is watched; `Health.first_term` points into it."""
    return term_names(watched(params, dict.fromkeys(LOSS_TERMS, 0.0), params))


def _update(
    learner: Learner,
    scalars: PpoScalars,
    rollout: Rollout,
    train: TrainState,
    batch: tuple[Int[Array, " n"], PRNGKeyArray],
) -> tuple[TrainState, Totals]:
    """Returns `train` after one minibatch, unchanged if anything is not finite."""
    index, key = batch
    loss_and_gradient = jax.value_and_grad(learner.loss, has_aux=True)
    (_, terms), gradient = loss_and_gradient(
        train.params, scalars, train.normalizer, minibatch(rollout, index), key
    )
    waits = train.iteration < scalars.critic_iterations
    adapted = adapt_learning_rate(train.optimizer, terms["kl_mean"], scalars)
    rate = jnp.where(waits, learning_rate(train.optimizer), learning_rate(adapted))
    optimizer = with_learning_rate(adapted, rate)
    step, optimizer = learner.optimizer.update(gradient, optimizer)  # pyright: ignore
    still = jax.tree.map(lambda x: jnp.where(waits, 0.0, x), step.policy)  # pyright: ignore
    params = optax.apply_updates(train.params, step.replace(policy=still))  # pyright: ignore
    finite = finite_terms(watched(train.params, terms, gradient))
    ok = jnp.all(finite)
    kept = jax.tree.map(
        lambda new, old: jnp.where(ok, new, old),
        (params, optimizer),
        (train.params, train.optimizer),
    )
    train = dataclasses.replace(
        train,
        params=kept[0],
        optimizer=kept[1],
        health=record(train.health, finite, train.iteration),
    )
    return train, _update_totals(terms, gradient, ok, learning_rate(kept[1]))


def _policy_begins(train: TrainState, scalars: PpoScalars) -> TrainState:
    """Returns `train` with the lowest rate if the critic has just learned alone."""
    waited = scalars.critic_iterations > 0
    begins = waited & (train.iteration == scalars.critic_iterations)
    now = learning_rate(train.optimizer)
    rate = jnp.where(begins, scalars.learning_rate_min, now)
    optimizer = with_learning_rate(train.optimizer, rate)
    return dataclasses.replace(train, optimizer=optimizer)


def minibatch(rollout: Rollout, index: Int[Array, " n"]) -> Transition:
    """Returns the worlds `index` of `rollout` as Brax's loss wants them, worlds first.

    x[i, t] = rollout.x[t, indexᵢ]; the discount is 1 - done [1]. Of the observations
    after each step the loss reads only the last of a trajectory, and only what the
    critic sees; no others are kept.

    Source:
        `compute_ppo_loss` of `brax.training.agents.ppo.losses`.
    """

    def take(steps: Array) -> Array:
        return jnp.swapaxes(steps[:, index], 0, 1)

    extras: Any = {
        "state_extras": {"truncation": take(rollout.truncation)},
        "policy_extras": {
            "raw_action": take(rollout.action),
            "log_prob": take(rollout.log_prob),
            "distribution_params": jax.tree.map(take, rollout.logits),
        },
    }
    following: Any = {"privileged_state": rollout.last_obs[index][:, None]}
    return Transition(
        observation=jax.tree.map(take, rollout.obs),
        action=take(rollout.action),
        reward=take(rollout.reward),
        discount=1.0 - take(rollout.done),
        next_observation=following,
        extras=extras,
    )


def _update_totals(
    terms: dict[str, Array], gradient: Any, ok: Array, rate: Array
) -> Totals:
    """Returns the metrics of one update; the terms of a skipped one do not count."""
    totals = {name: total(terms[k], ok) for k, name in LOSS_TERMS.items()}
    totals["grad_norm"] = total(optax.tree.norm(gradient), ok)
    totals["learning_rate"] = total(rate)
    return totals
