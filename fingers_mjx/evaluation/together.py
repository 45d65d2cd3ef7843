"""Evaluation of several policies at once, side by side in one batch of worlds."""

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array

from envs.base import State
from fingers_mjx.evaluation.evaluate import (
    Episodes,
    EpisodeTable,
    Progress,
    episode_table,
    run_episodes,
)
from fingers_mjx.evaluation.source import measuring
from fingers_mjx.evaluation.wrapped import Wrapped
from fingers_mjx.policy.actor import acting_together
from fingers_mjx.policy.source import PolicySource
from fingers_mjx.runs.setup import make_env


@dataclass(frozen=True)
class _Alike(Wrapped):
    """Equal parts of a batch, each of which begins as a batch of its size alone.

    Attributes:
        parts: how many.
    """

    parts: int

    def reset(self, key: Array) -> State:
        """Starts the same episodes in every part."""
        return self.env.reset(jnp.stack([key] * self.parts))


def evaluate_together(
    sources: Sequence[PolicySource],
    episodes: int,
    seed: int = 0,
    backend: str = "cpu",
    progress: Progress | None = None,
) -> list[EpisodeTable]:
    """Runs each policy in the episodes that it would have alone, all in one program.

    Whether there was space for all contacts is left to the caller
    (`source.check_room`), so that one policy does not take the others with it.

    Args:
        sources: policies whose setups share a program
            (`fingers_mjx.training.population`).
        episodes: number for each policy, in as many worlds at once.
        seed: of worlds, commands and noise.
        backend: physics backend.
        progress: called with (steps done, steps in all).

    Returns:
        One table a policy; on the CPU, to the last bit that of `evaluate_source`.

    Raises:
        InputError: settings that do not fit.

    Source:
        Ours.
    """
    number = len(sources)
    batch = make_env(sources[0].setup, number * episodes, backend, auto_reset=False)
    traces, worlds = run_episodes(
        _Alike(batch, number),
        acting_together([one.network for one in sources]),
        Episodes(number * episodes, batch.episode_length, jax.random.key(seed)),
        progress,
    )
    found = []
    for first in range(0, number * episodes, episodes):
        own = jax.tree.map(lambda x, i=first: x[:, i : i + episodes], traces)
        drawn = {name: of[first : first + episodes] for name, of in worlds.items()}
        found.append(episode_table(own, float(batch.dt), measuring(batch), drawn))
    return found
