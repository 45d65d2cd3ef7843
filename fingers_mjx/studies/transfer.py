"""What knowing an effect gains: policies of two hands, equal budget, in the real one.

Some are trained on the default hand, as many with the same seeds on the hand that
identification extended. All then walk in the simulator that carries the effect, in the
same worlds.
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
from fingers_mjx.evaluation.direction import better
from fingers_mjx.evaluation.evaluate import EpisodeTable
from fingers_mjx.evaluation.measures import steps_alive
from fingers_mjx.evaluation.setups import nominal, with_command
from fingers_mjx.evaluation.source import evaluate_source, summary
from fingers_mjx.evaluation.stats import paired_difference
from fingers_mjx.policy.interface import identity
from fingers_mjx.policy.source import PolicySource
from fingers_mjx.runs.setup import Setup, training_env
from fingers_mjx.studies.comparison.comparison import Row, corrected
from fingers_mjx.studies.statistics.compare import difference
from fingers_mjx.studies.statistics.pairs import pair
from fingers_mjx.studies.sweep.member import start_of
from fingers_mjx.studies.sweep.plan import Training
from fingers_mjx.training.progress import OnProgress
from fingers_mjx.training.train import train

MEASURES = ("task_speed_mps", "survival", "turn_rate_error_rad_s")
"""Of episodes with the task's own commands."""

BY_SIZE = ("drift_deg_s", "sideways_mps")
"""Measures that are compared by their size, whatever their side."""

Values = Mapping[str, Mapping[str, Sequence[float | None]]]
"""Means over episodes by measure and arm, one for each seed."""

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
) -> None:
    """Trains a policy with a hand; everything else, the seed too, is that of `setup`.

    A training that was stopped goes on, one that is done is not repeated.

    Args:
        setup: settings of learner and task.
        hand: hand to train on.
        path: run directory.
        warm: networks to start from; None for fresh ones.
        say: called with the events of the training.

    Raises:
        InputError: settings or a hand with which there is no environment, or others
            than those of the training that was stopped.
    """
    setup = dataclasses.replace(setup, hand=hand)
    start = start_of(Training(path, setup, keep_schedules=False), warm)
    if start is None:
        return
    env = training_env(setup)
    train(env, setup, path, start=start, identity=identity(env), on_progress=say)


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
    sources: Mapping[str, Sequence[PolicySource]],
    found: Mapping[str, Sequence[Evaluated]],
    seeds: Sequence[int],
    evaluation_seed: int,
    conditions: Mapping[str, Any],
) -> dict[str, Any]:
    """Returns the comparison for JSON.

    Args:
        sources: policies of each arm, one for each seed, `default` first.
        found: their evaluations.
        seeds: of the trainings, in the order of the policies.
        evaluation_seed: of worlds and commands.
        conditions: what else it takes to repeat it.

    Raises:
        InputError: there are not two arms with one policy for each seed.
    """
    if [len(arm) for arm in sources.values()] != [len(seeds)] * 2:
        sizes = " and ".join(str(len(arm)) for arm in sources.values())
        raise InputError("compared", "sources", sizes, "two arms with equal seeds")
    tables = {name: [columns(one) for one in arm] for name, arm in found.items()}
    task = next(iter(sources.values()))[0].setup.train.task
    values = {
        name: {arm: [_mean(name, one) for one in of] for arm, of in tables.items()}
        for name in next(iter(tables.values()))[0]
    }
    document = {
        "seeds": list(seeds),
        "policies": {
            name: [
                summary(source, table, evaluation_seed)
                for source, table in zip(arm, tables[name], strict=True)
            ]
            for name, arm in sources.items()
        },
        "gain": gains(values, seeds, task),
        "conditions": dict(conditions),
    }
    if len(seeds) == 1:
        document["over_worlds"] = _over_worlds(*[arm[0] for arm in tables.values()])
    return document


def gains(values: Values, seeds: Sequence[int], task: str) -> dict[str, dict[str, Any]]:
    """Returns the second arm less the first, paired over seeds, for each measure.

    Args:
        values: by measure and arm, one mean for each seed; None where none is defined.
        seeds: of the trainings, in the order of the means.
        task: of the policies.
    """
    rows = []
    for name, arms in values.items():
        (_, other), (arm, ours) = arms.items()
        pairs = pair(_by_seed(seeds, ours), _by_seed(seeds, other))
        direction = better(task, name)
        rows.append(Row(arm, name, direction, difference(pairs, direction), None))
    return {
        row.measure: {
            **dataclasses.asdict(row.difference),
            "better": row.better,
            "p_holm": row.p_holm,
            "values": {arm: [*of] for arm, of in values[row.measure].items()},
        }
        for row in corrected(rows)
    }


def _by_seed(seeds: Sequence[int], means: Sequence[float | None]) -> dict[int, float]:
    known = [np.nan if mean is None else mean for mean in means]
    return dict(zip(seeds, known, strict=True))


def _mean(name: str, table: Mapping[str, np.ndarray]) -> float | None:
    """Mean over the episodes of a policy that define a measure."""
    defined = _size(name, table[name])[np.isfinite(table[name])]
    return _known(float(defined.mean())) if len(defined) else None


def _size(name: str, values: np.ndarray) -> np.ndarray:
    return np.abs(values) if name in BY_SIZE else values


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _over_worlds(
    before: Mapping[str, np.ndarray], after: Mapping[str, np.ndarray]
) -> dict[str, dict[str, float | None]]:
    """Second policy less the first, world by world; drift by its size.

    Intervals are over worlds, for these two trainings: other seeds, other policies.
    """
    found = {}
    for name in before:
        one = paired_difference(_size(name, after[name]), _size(name, before[name]))
        values = {"mean": one.mean, "low": one.low, "high": one.high, "n": one.n}
        found[name] = {k: _known(v) for k, v in values.items()}
    return found
