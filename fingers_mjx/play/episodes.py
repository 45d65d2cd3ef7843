"""Many episodes of the closed loop, measured as an evaluation measures its own."""

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import numpy as np

from fingers_mjx.evaluation.evaluate import EpisodeTable, Progress, episode_table
from fingers_mjx.evaluation.record import Trace
from fingers_mjx.evaluation.source import measuring
from fingers_mjx.play.player import Played, Player, Schedule


@dataclass(frozen=True)
class Session:
    """What was played.

    Attributes:
        table: measures and traces of all episodes.
        first: the first episode, for pictures.
        held: control steps of all episodes in which the shim held its target.
    """

    table: EpisodeTable
    first: Played
    held: int


def play_episodes(
    player: Player,
    episodes: int,
    steps: int,
    seed: int = 0,
    schedule: Schedule | None = None,
    progress: Progress | None = None,
) -> Session:
    """Plays episodes one after the other.

    Worlds, starts and commands are those that `fingers eval` draws from the same seed
    for the same number of episodes.

    Args:
        player: policy and worlds.
        episodes: number of episodes.
        steps: control steps of each.
        seed: of the worlds.
        schedule: a command for each step; drawn as in training if not given.
        progress: called with (episodes played, episodes in all).
    """
    keys = jax.random.split(jax.random.fold_in(jax.random.key(seed), 0), episodes)
    played = []
    for index, key in enumerate(keys):
        played.append(player.play(key, steps, schedule))
        if progress is not None:
            progress(index + 1, episodes)
    traces = [_padded(one.trace, steps) for one in played]
    joined = jax.tree.map(lambda *x: np.stack(x, axis=1), *traces)
    env = player.env
    table = episode_table(joined, env.dt, measuring(env))
    return Session(table, played[0], sum(one.held for one in played))


def schedule_of(commands: Sequence[Sequence[float]], steps: int) -> Schedule:
    """Returns a command for each step; the commands share the time equally.

    Args:
        commands: v_x, v_y [m/s] and yaw rate [rad/s] each.
        steps: control steps.
    """
    part = np.arange(steps) * len(commands) // steps
    return np.asarray(commands, np.float32)[part]


def _padded(trace: Trace, steps: int) -> Trace:
    """Repeats the last step, in which the hand fell; what follows does not count."""
    missing = steps - len(trace.done)
    return jax.tree.map(
        lambda x: np.concatenate([x, np.repeat(x[-1:], missing, axis=0)]), trace
    )
