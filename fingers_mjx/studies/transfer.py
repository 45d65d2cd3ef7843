"""What knowing an effect gains: two policies with equal budget in the real hand.

One is trained on the default hand, one on the hand that identification extended. Both
then walk in the simulator that carries the effect, in the same worlds.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np

from envs.errors import InputError
from envs.hand.hand_file import HandFile
from fingers_mjx.evaluation.evaluate import EpisodeTable
from fingers_mjx.evaluation.measures import steps_alive
from fingers_mjx.evaluation.source import (
    evaluate_source,
    nominal,
    summary,
    with_command,
)
from fingers_mjx.evaluation.stats import paired_difference
from fingers_mjx.policy.interface import identity
from fingers_mjx.policy.source import PolicySource
from fingers_mjx.runs.setup import (
    Setup,
    make_env,
)
from fingers_mjx.training.progress import OnProgress
from fingers_mjx.training.train import Result, Start, train

MEASURES = ("task_speed_mps", "survival", "turn_rate_error_rad_s")
"""Of episodes with the task's own commands."""

STRAIGHT = (0.10, 0.0, 0.0)
"""Command of the episodes in which drift is measured: v_x, v_y [m/s], yaw [rad/s]."""


@dataclass(frozen=True)
class Evaluated:
    """One policy in the real hand.

    Attributes:
        task: episodes with the task's own commands, in randomized worlds.
        straight: episodes with the command `STRAIGHT`, without noise.
    """

    task: EpisodeTable
    straight: EpisodeTable


def train_on(
    setup: Setup, hand: HandFile, path: Path, warm: Path | None, say: OnProgress
) -> Result:
    """Trains a policy with a hand; everything else, the seed too, is that of `setup`.

    Args:
        setup: settings of learner and task.
        hand: hand to train on.
        path: new run directory.
        warm: networks to start from; None for fresh ones.
        say: called with the events of the training.

    Raises:
        InputError: settings or a hand with which there is no environment.
    """
    setup = dataclasses.replace(setup, hand=hand)
    env = make_env(setup, setup.train.num_envs, setup.train.backend)
    return train(
        env,
        setup,
        path,
        start=Start(warm_start=warm),
        identity=identity(env),
        on_progress=say,
    )


def in_real_hand(
    source: PolicySource,
    real: HandFile,
    episodes: int,
    seed: int = 0,
    backend: str = "cpu",
    steps: int | None = None,
) -> Evaluated:
    """Evaluates a policy in the hand that carries the effect.

    Args:
        source: the policy.
        real: the hand file of the simulator that stands for the hardware.
        episodes: of each kind.
        seed: of worlds, commands and noise; the same for every policy.
        backend: physics backend.
        steps: control steps of an episode; as in training if not given.

    Raises:
        InputError: a task without commands, or settings that do not fit.
    """
    setup = dataclasses.replace(source.setup, hand=real)
    straight = with_command(nominal(setup), STRAIGHT)
    tables = [
        evaluate_source(
            dataclasses.replace(source, setup=s), episodes, seed, backend, steps
        )
        for s in (setup, straight)
    ]
    return Evaluated(*tables)


def drift(table: EpisodeTable) -> dict[str, np.ndarray]:
    """Returns the motion of a hand commanded to walk straight, one value per episode.

    `drift_deg_s` is the mean turn rate, positive to the left; `sideways_mps` the mean
    speed to the left in V. Both over the steps before a fall.
    """
    traces = table.traces
    alive = np.asarray(jax.vmap(steps_alive, 1, 1)(traces.done, traces.failed))
    count = np.maximum(alive.sum(0), 1)
    turned = np.where(alive, traces.yaw_rate, 0.0).sum(0) / count
    sideways = np.where(alive, traces.vel_v[..., 1], 0.0).sum(0) / count
    return {"drift_deg_s": np.rad2deg(turned), "sideways_mps": sideways}


def columns(found: Evaluated) -> dict[str, np.ndarray]:
    """Returns all that is compared, one value per episode."""
    own = {name: found.task.columns[name] for name in MEASURES}
    straight = found.straight.columns
    return {
        **own,
        **drift(found.straight),
        "straight_speed_mps": straight["task_speed_mps"],
        "straight_survival": straight["survival"],
    }


def compared(
    sources: Mapping[str, PolicySource],
    found: Mapping[str, Evaluated],
    seed: int,
    conditions: Mapping[str, Any],
) -> dict[str, Any]:
    """Returns the comparison for JSON.

    Args:
        sources: policies by name, `default` first.
        found: their evaluations.
        seed: of the evaluation.
        conditions: what else it takes to repeat it.
    """
    names = list(sources)
    if len(names) != 2:
        raise InputError("compared", "sources", len(names), "two policies")
    tables = {name: columns(found[name]) for name in names}
    return {
        "policies": {n: summary(s, tables[n], seed) for n, s in sources.items()},
        "gain": _gains(tables, names),
        "conditions": dict(conditions),
    }


def _gains(
    tables: Mapping[str, Mapping[str, np.ndarray]], names: Sequence[str]
) -> dict[str, dict[str, float | None]]:
    """Second policy less the first, world by world; drift by its size.

    Intervals are over worlds, for these two trainings: other seeds, other policies.
    """
    before, after = (tables[name] for name in names)
    found = {}
    for name in before:
        size = np.abs if name in ("drift_deg_s", "sideways_mps") else np.asarray
        one = paired_difference(size(after[name]), size(before[name]))
        values = {"mean": one.mean, "low": one.low, "high": one.high, "n": one.n}
        found[name] = {k: v if np.isfinite(v) else None for k, v in values.items()}
    return found
