"""Proximal policy optimization: one compiled iteration over the whole training state.

One iteration unrolls the policies in every world, makes epochs x minibatches clipped
updates with a rate that follows the KL divergence, then updates the normalizer (after
the updates, so that the divergence is measured with the statistics of the rollout).
Networks, loss and rate are Brax's (`fingers_mjx.ppo.brax`).

It does so for a population: S learners, each with its own worlds, networks, random key
and numbers (`fingers_mjx.ppo.scalars`). A single run is a population of one.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import PRNGKeyArray

from envs.base import State, VectorEnv
from fingers_mjx.ppo.members import each, split_each
from fingers_mjx.ppo.rollout import Rollout, unroll
from fingers_mjx.ppo.scalars import PpoScalars
from fingers_mjx.ppo.state import Learner, TrainState
from fingers_mjx.ppo.totals import Totals
from fingers_mjx.ppo.update import improve

Iteration = Callable[
    [PpoScalars, TrainState, State, PRNGKeyArray],
    tuple[TrainState, State, PRNGKeyArray, Totals],
]
"""Everything but the worlds has the members first; the worlds are one flat batch."""


def make_iteration(env: VectorEnv, learner: Learner) -> Iteration:
    """Returns the pure function of one iteration; `compile_iterations` compiles it.

    Args:
        env: worlds of all members, in equal parts.
        learner: what they share.
    """

    def learn(
        scalars: PpoScalars, train: TrainState, rollout: Rollout, key: PRNGKeyArray
    ) -> tuple[TrainState, Totals]:
        better, totals = improve(learner, scalars, train, rollout, key)
        frozen = train.health.worst_streak >= learner.config.max_bad_updates
        kept = jax.tree.map(lambda old, new: jnp.where(frozen, old, new), train, better)
        return kept, totals

    def iteration(
        scalars: PpoScalars, train: TrainState, worlds: State, keys: PRNGKeyArray
    ) -> tuple[TrainState, State, PRNGKeyArray, Totals]:
        keys, unroll_keys, update_keys = split_each(keys, 3)
        worlds, rollout, totals = unroll(env, learner, train, worlds, unroll_keys)
        train, update_totals = each(learn)(scalars, train, rollout, update_keys)
        return train, worlds, keys, totals | update_totals

    return iteration


def repeat_iterations(iteration: Iteration, repeat: int) -> Iteration:
    """Returns the function that does `iteration` `repeat` times; metrics add up."""

    def repeated(
        scalars: PpoScalars, train: TrainState, worlds: State, keys: PRNGKeyArray
    ) -> tuple[TrainState, State, PRNGKeyArray, Totals]:
        if repeat == 1:
            return iteration(scalars, train, worlds, keys)

        def body(carry: tuple, _: None) -> tuple[tuple, Totals]:
            *carried, totals = iteration(scalars, *carry)
            return tuple(carried), totals

        carry, totals = jax.lax.scan(body, (train, worlds, keys), length=repeat)
        return *carry, jax.tree.map(lambda x: jnp.sum(x, axis=0), totals)

    return repeated


def compile_iterations(iteration: Iteration, repeat: int = 1) -> Iteration:
    """Returns `iteration` compiled, `repeat` times over in one call.

    All arguments but the first are given away: they cannot be used after the call.
    """
    return jax.jit(repeat_iterations(iteration, repeat), donate_argnums=(1, 2, 3))
