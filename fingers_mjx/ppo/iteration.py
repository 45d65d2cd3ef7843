"""Proximal policy optimization: one compiled iteration over the whole training state.

One iteration unrolls the policy in every world, makes epochs x minibatches clipped
updates with a rate that follows the KL divergence, then updates the normalizer (after
the updates, so that the divergence is measured with the statistics of the rollout).
Networks, loss and rate are Brax's (`fingers_mjx.ppo.brax`).
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import PRNGKeyArray

from envs.base import State, VectorEnv
from fingers_mjx.ppo.rollout import unroll
from fingers_mjx.ppo.state import Learner, TrainState
from fingers_mjx.ppo.totals import Totals
from fingers_mjx.ppo.update import improve

Iteration = Callable[
    [TrainState, State, PRNGKeyArray],
    tuple[TrainState, State, PRNGKeyArray, Totals],
]


def make_iteration(env: VectorEnv, learner: Learner) -> Iteration:
    """Returns the pure function of one iteration; `compile_iterations` compiles it."""

    def iteration(
        train: TrainState, worlds: State, key: PRNGKeyArray
    ) -> tuple[TrainState, State, PRNGKeyArray, Totals]:
        key, key_unroll, key_update = jax.random.split(key, 3)
        worlds, rollout, totals = unroll(env, learner, train, worlds, key_unroll)
        train, update_totals = improve(learner, train, rollout, key_update)
        return train, worlds, key, totals | update_totals

    return iteration


def repeat_iterations(iteration: Iteration, repeat: int) -> Iteration:
    """Returns the function that does `iteration` `repeat` times; metrics add up."""

    def body(carry: tuple, _: None) -> tuple[tuple, Totals]:
        train, worlds, key, totals = iteration(*carry)
        return (train, worlds, key), totals

    def repeated(
        train: TrainState, worlds: State, key: PRNGKeyArray
    ) -> tuple[TrainState, State, PRNGKeyArray, Totals]:
        if repeat == 1:
            return iteration(train, worlds, key)
        carry, totals = jax.lax.scan(body, (train, worlds, key), length=repeat)
        return *carry, jax.tree.map(lambda x: jnp.sum(x, axis=0), totals)

    return repeated


def compile_iterations(iteration: Iteration, repeat: int = 1) -> Iteration:
    """Returns `iteration` compiled, `repeat` times over in one call.

    The three arguments are given away: they cannot be used after the call.
    """
    return jax.jit(repeat_iterations(iteration, repeat), donate_argnums=(0, 1, 2))
