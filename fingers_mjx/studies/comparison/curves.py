"""Learning curves of the members of a sweep, and their bands over seeds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from fingers_mjx.runs.metrics import read_metrics
from fingers_mjx.studies.statistics.intervals import t_interval
from fingers_mjx.studies.sweep.manifest import Manifest

STEPS = "env_steps"
POINTS = 120


@dataclass(frozen=True, eq=False)
class Curve:
    """Rows of the learning curve of one member, all its stages one after the other.

    Attributes:
        configuration: by name.
        seed: of the training.
        done: whether the member was trained to its end.
        rows: with `env_steps` counted from the start of the first stage.
    """

    configuration: str
    seed: int
    done: bool
    rows: Sequence[Mapping[str, Any]]

    def of(
        self, metric: str
    ) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
        """Control steps and values of a metric, from the rows that have it."""
        kept = [r for r in self.rows if r.get(metric) is not None]
        x, y = ([row[name] for row in kept] for name in (STEPS, metric))
        return np.array(x, float), np.array(y, float)


@dataclass(frozen=True, eq=False)
class Band:
    """Mean over seeds and its pointwise 95 % interval, where all seeds have values."""

    steps: Float[np.ndarray, " k"]
    mean: Float[np.ndarray, " k"]
    low: Float[np.ndarray, " k"]
    high: Float[np.ndarray, " k"]


def read_curves(root: Path, manifest: Manifest) -> list[Curve]:
    """Returns the curve of every member that has begun.

    Args:
        root: directory of the sweep.
        manifest: its members.
    """
    found = []
    for member in manifest.members:
        rows = _joined(member.key.directory(root), manifest.stages)
        done = member.state == "done"
        if rows:
            found.append(Curve(member.configuration, member.seed, done, rows))
    return found


def _joined(directory: Path, stages: Sequence[str]) -> list[dict[str, Any]]:
    """Rows of all stages; a stage that counts from zero begins where the last ended."""
    rows: list[dict[str, Any]] = []
    for stage in stages:
        new = [
            r for r in read_metrics(directory / stage / "metrics.jsonl") if STEPS in r
        ]
        end = rows[-1][STEPS] if rows else 0
        offset = end if new and new[0][STEPS] <= end else 0
        rows += [{**row, STEPS: row[STEPS] + offset} for row in new]
    return rows


def band(curves: Sequence[Curve], metric: str) -> Band | None:
    """x̄_t = Σ_i x_it/n and its interval over seeds i at common steps t [its unit, 1].

    Values between rows are interpolated. None if fewer than two curves overlap.

    Args:
        curves: of one configuration.
        metric: key of the rows.

    Source:
        `t_interval`, at each t by itself: a band is no statement on whole curves.
    """
    lines = [xy for curve in curves if len((xy := curve.of(metric))[0])]
    if len(lines) < 2:
        return None
    first, last = max(x[0] for x, _ in lines), min(x[-1] for x, _ in lines)
    if first >= last:
        return None
    steps = np.linspace(first, last, POINTS)
    values = np.stack([np.interp(steps, x, y) for x, y in lines], axis=-1)
    return Band(steps, values.mean(axis=-1), *t_interval(values))
