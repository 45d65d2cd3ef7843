"""Evaluation of a policy with its exploration noise: how training itself sees it."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.base import State
from envs.batch import BatchEnv
from envs.streams import stream
from fingers_mjx.evaluation.evaluate import (
    Episodes,
    EpisodeTable,
    Measuring,
    Progress,
    evaluate,
)
from fingers_mjx.evaluation.wrapped import Wrapped
from fingers_mjx.policy.actor import Network, acting


@dataclass(frozen=True)
class Exploring(Wrapped):
    """Worlds that add noise to every action, drawn from each world's own stream.

    Attributes:
        noise_std: standard deviation of the noise, one per action or for all.
    """

    noise_std: Any

    def step(self, state: State, action: Float[Array, "b a"]) -> State:
        """Advances every world under the action and its noise."""
        world = state.memory.world
        noise = jax.vmap(_noise, (0, 0, None))(
            world.key, world.total_steps, action.shape[-1]
        )
        return self.env.step(state, action + jnp.asarray(self.noise_std) * noise)


def explore(
    env: BatchEnv,
    network: Network,
    noise_std: float | Float[np.ndarray, " a"],
    steps: int,
    seed: int,
    progress: Progress,
) -> EpisodeTable:
    """Measures one episode in each world of `env` under a noisy policy.

    Args:
        env: worlds.
        network: policy.
        noise_std: standard deviation of the noise on its actions.
        steps: longest episode in control steps.
        seed: of worlds, commands and noise.
        progress: called with (steps done, steps in all).
    """
    return evaluate(
        Exploring(env, noise_std),
        acting(network),
        Episodes(env.num_envs, steps, jax.random.key(seed)),
        Measuring(float(env.mj_model.body_mass.sum())),
        progress,
    )


def _noise(key: Array, step: Array, size: int) -> Float[Array, " a"]:
    key = jax.random.fold_in(stream(key, "exploration"), step)
    return jax.random.normal(key, (size,))
