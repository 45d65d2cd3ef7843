"""Tables of a comparison as text cells, for the terminal and the page."""

from collections.abc import Sequence

from fingers_mjx.reports.page import shown
from fingers_mjx.studies.comparison.comparison import Comparison, Row
from fingers_mjx.studies.statistics.compare import Arm, Difference

HEADER = (
    "measure",
    "configuration",
    "difference",
    "95 % interval",
    "in favour",
    "P(better)",
    "p, Holm",
    "detectable",
)
ARROWS = {"higher": "↑", "lower": "↓", None: ""}
"""Which direction is better."""
SPACE = "\N{NO-BREAK SPACE}"


def difference_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    """Returns the rows under `HEADER`, one for each comparison.

    Args:
        comparison: of a sweep.
    """
    return [cells(row) for row in comparison.rows]


def cells(row: Row) -> tuple[str, ...]:
    """Returns the text of one comparison under `HEADER`.

    Args:
        row: one measure of one configuration.
    """
    found = row.difference
    return (
        f"{row.measure}{SPACE}{ARROWS[row.better]}".strip(),
        row.configuration,
        "–" if found.mean is None else f"{found.mean:+.3g}",
        interval(found.low, found.high),
        _votes(found),
        "–" if found.improvement is None else f"{found.improvement:.2f}",
        short(row.p_holm),
        short(found.detectable),
    )


def _votes(found: Difference) -> str:
    """Seeds in favour, and on how many nothing differs."""
    if found.in_favour is None or found.against is None:
        return f"– of {found.n}".replace(" ", SPACE)
    equal = found.n - found.in_favour - found.against
    more = f" ({equal} =)" if equal else ""
    return f"{found.in_favour} of {found.n}{more}".replace(" ", SPACE)


def interval(low: float | None, high: float | None) -> str:
    """Returns both ends as text, a dash if there is no interval.

    Args:
        low: one end.
        high: the other.
    """
    if low is None or high is None:
        return "–"
    return f"{low:.3g} to {high:.3g}".replace(" ", SPACE)


def short(value: float | None) -> str:
    """Returns a number with three digits: enough for p, and for what could be seen.

    Args:
        value: None is a dash.
    """
    return "–" if value is None else f"{value:.3g}"


def arm_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    """Returns mean and interquartile mean of every configuration, with intervals.

    Args:
        comparison: of a sweep.
    """
    return [
        (cell.measure, cell.configuration, str(cell.arm.n), *_arm(cell.arm))
        for cell in comparison.cells
    ]


def _arm(arm: Arm) -> tuple[str, ...]:
    middle = (shown(arm.iqm), interval(arm.iqm_low, arm.iqm_high))
    return (shown(arm.mean), interval(arm.low, arm.high), *middle)


def notes(comparison: Comparison) -> list[str]:
    """Returns what must be known to read the comparison, a sentence each.

    Args:
        comparison: of a sweep.
    """
    together = len(comparison.rows)
    family = f"{together} comparisons read together: p, Holm is corrected for all."
    alone = "One comparison: there is nothing to correct for."
    said = [family if together > 1 else alone]
    own = (_chose, _anew, _few, _dropped)
    return said + [sentence for of in own for sentence in of(comparison)]


def _chose(comparison: Comparison) -> list[str]:
    """Which seeds have chosen what, and do not count for it."""
    return [
        f"Left out, since they chose {name}: seeds {_listed(seeds)}."
        for name, seeds in comparison.results.chose.items()
    ]


def _anew(comparison: Comparison) -> list[str]:
    """Which seeds count although they diverged at first."""
    return [
        f"Diverged at first and trained anew, {name}: seeds {_listed(seeds)}; "
        "an arm that diverges more often is shown at its better ones."
        for name, seeds in comparison.results.anew.items()
    ]


def _few(comparison: Comparison) -> list[str]:
    """What one seed shows, and where numbers are undefined for another reason."""
    said: dict[str, list[str]] = {}
    for row in comparison.rows:
        if row.difference.note:
            where = f"{row.measure} of {row.configuration}"
            said.setdefault(row.difference.note, []).append(where)
    return [f"{_capital(note)}: {_listed(of)}." for note, of in said.items()]


def _dropped(comparison: Comparison) -> list[str]:
    """Which seeds are left out, and why."""
    said = _missing(comparison)
    if comparison.missing:
        text = "Their seeds are left out of both arms, which favours what fails often"
        said.append(
            f"{text}: a mean over the trainings that worked is not one over all."
        )
    said += _alone(comparison)
    undefined = [
        f"{cell.measure} of {cell.configuration}/{seed}"
        for cell in comparison.cells
        for seed, value in cell.values.items()
        if value is None
    ]
    if undefined:
        said.append(f"Undefined in all episodes, left out: {_listed(undefined)}.")
    return said


def _missing(comparison: Comparison) -> list[str]:
    """A sentence for each configuration and reason: many members may just wait."""
    seeds: dict[tuple[str, str], list[str]] = {}
    for lost in comparison.missing:
        seeds.setdefault((lost.configuration, lost.reason), []).append(str(lost.seed))
    return [
        f"Missing: {name}/{', '.join(of)}, {reason}."
        for (name, reason), of in seeds.items()
    ]


def _alone(comparison: Comparison) -> list[str]:
    """Seeds that a sweep has of one arm and not of the other, such as after search."""
    own = comparison.results.seeds(comparison.baseline)
    alone = {
        row.configuration: comparison.results.seeds(row.configuration) ^ own
        for row in comparison.rows
    }
    listed = [f"{n} ({_listed(sorted(s))})" for n, s in alone.items() if s]
    if not listed:
        return []
    text = f"Seeds that only {comparison.baseline} or only the other has are left out"
    return [f"{text}: {_listed(listed)}."]


def _listed(names: Sequence[object], most: int = 6) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(map(str, names[:most])) + more


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
