"""Configurations against a baseline: all differences, corrected together."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envs.errors import InputError, one_of
from fingers_deploy.errors import shortened
from fingers_mjx.evaluation.direction import Better, better
from fingers_mjx.studies.comparison.results import Missing, Results
from fingers_mjx.studies.statistics.compare import Arm, Difference, arm, difference
from fingers_mjx.studies.statistics.pairs import pair
from fingers_mjx.studies.statistics.significance import holm
from fingers_mjx.studies.sweep.manifest import number_of

MOST_NAMES, MOST_LETTERS = 6, 60
"""Of members that are missing: how many a sentence names, and letters of a reason."""


@dataclass(frozen=True)
class Cell:
    """One measure of one configuration.

    Attributes:
        configuration: by name.
        measure: by name.
        values: one for each seed that was evaluated; None where undefined.
        arm: over these seeds.
    """

    configuration: str
    measure: str
    values: dict[int, float | None]
    arm: Arm


@dataclass(frozen=True)
class Row:
    """One measure of one configuration against the baseline.

    Attributes:
        configuration: by name.
        measure: by name.
        better: which direction is; None for neither.
        difference: configuration less baseline, paired over seeds.
        p_holm: p corrected for all rows of the comparison.
    """

    configuration: str
    measure: str
    better: Better | None
    difference: Difference
    p_holm: float | None


@dataclass(frozen=True)
class Comparison:
    """All configurations of a sweep against one of them.

    Attributes:
        results: what was measured.
        baseline: name of the configuration that the others are compared with.
        measures: names, in the order of the tables.
        cells: each measure of each configuration.
        rows: each measure of each configuration but the baseline.
    """

    results: Results
    baseline: str
    measures: tuple[str, ...]
    cells: tuple[Cell, ...]
    rows: tuple[Row, ...]

    @property
    def missing(self) -> tuple[Missing, ...]:
        """Members without a measurement."""
        return self.results.missing

    @property
    def seeds(self) -> int:
        """The most seeds that any two arms share."""
        return max((row.difference.n for row in self.rows), default=0)

    def cell(self, configuration: str, measure: str) -> Cell:
        """Returns one measure of one configuration."""
        wanted = (configuration, measure)
        return next(c for c in self.cells if (c.configuration, c.measure) == wanted)


def check_complete(results: Results, source: object) -> None:
    """Refuses a sweep of which members are missing.

    Args:
        results: what was measured.
        source: of the results, for the message.

    Raises:
        InputError: naming the members that are missing.
    """
    if results.missing:
        found = f"{len(results.missing)} of {number_of(results.members)} missing"
        valid = f"all done, or --allow-partial; missing: {_named(results.missing)}"
        raise InputError(source, "", found, valid)


def compared(
    results: Results, baseline: str, measures: Sequence[str] | None = None
) -> Comparison:
    """Compares every configuration with the baseline, seed by seed.

    Args:
        results: what was measured.
        baseline: name of a configuration.
        measures: names; those of the task that have a better direction if not given.

    Raises:
        InputError: no such configuration or measure, listing those that there are, or
            only one configuration.
    """
    if baseline not in results.configurations:
        valid = one_of(results.configurations, baseline)
        raise InputError("--baseline", "", baseline, valid)
    others = [name for name in results.configurations if name != baseline]
    if not others:
        raise InputError("--baseline", "", "no other", "a sweep of two configurations")
    if not results.values:
        raise InputError("members", "", "none done", "at least one with an evaluation")
    chosen = _chosen(results, measures)
    rows = [_row(results, name, baseline, m) for m in chosen for name in others]
    return Comparison(
        results=results,
        baseline=baseline,
        measures=chosen,
        cells=tuple(
            _cell(results, n, m) for m in chosen for n in results.configurations
        ),
        rows=tuple(corrected(rows)),
    )


def corrected(rows: Sequence[Row]) -> list[Row]:
    """Returns rows with p̃ = Holm(p) over all of them [1].

    Args:
        rows: that are read together.

    Source:
        `holm`.
    """
    found = [row.difference.p for row in rows]
    known = [math.nan if p is None else p for p in found]
    together = holm(np.array(known, float))
    return [
        dataclasses.replace(row, p_holm=_known(p))
        for row, p in zip(rows, together, strict=True)
    ]


def _named(missing: Sequence[Missing]) -> str:
    """Names the first members that are missing, and says why the first is."""
    names = ", ".join(one.name for one in missing[:MOST_NAMES])
    more = len(missing) - MOST_NAMES
    names += f" and {more} more" if more > 0 else ""
    return f"{names}; {missing[0].name}: {shortened(missing[0].reason, MOST_LETTERS)}"


def _chosen(results: Results, measures: Sequence[str] | None) -> tuple[str, ...]:
    """Measures to compare, each once."""
    known = results.measures
    for name in measures or ():
        if name not in known:
            raise InputError("--measures", "", name, one_of(known, name))
    if measures:
        return tuple(dict.fromkeys(measures))
    directed = tuple(m for m in known if better(results.task, m))
    if not directed:
        found = f"no measure of {results.task} with a better direction"
        raise InputError("--measures", "", found, one_of(known))
    return directed


def _row(results: Results, name: str, baseline: str, measure: str) -> Row:
    """One row, not corrected yet."""
    arms = [results.values.get(n, {}).get(measure, {}) for n in (name, baseline)]
    direction = better(results.task, measure)
    return Row(name, measure, direction, difference(pair(*arms), direction), None)


def _cell(results: Results, name: str, measure: str) -> Cell:
    values = results.values.get(name, {}).get(measure, {})
    kept = {seed: _known(value) for seed, value in sorted(values.items())}
    return Cell(name, measure, kept, arm(np.array(list(values.values()), float)))


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
