"""The scores of a wide battery by each of its factors.

PYTHONPATH=.:deploy python -m benchmarks.diagnosis.factors ROWS.jsonl
"""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmarks.diagnosis.hidden.conditions import LEVELS
from benchmarks.diagnosis.score import Row, read_rows, report

QUIET = ("none", "not_observable")


def by_factor(rows: Sequence[Row]) -> str:
    """Returns a table: one line for each level of each factor."""
    lines = [
        f"{'factor':10s} {'level':9s} {'':5s}" + "".join(f"{t:>16s}" for t in HEAD)
    ]
    for factor, level, some in levels(rows):
        text = "".join(f"{score:>16s}" for score in scores(some))
        lines.append(f"{factor:10s} {level:9s} {len(some):5d}{text}")
    return "\n".join(lines)


def levels(rows: Sequence[Row]) -> Iterator[tuple[str, str, list[Row]]]:
    """Each level of each factor, with its rows."""
    for factor, names in LEVELS.items():
        for level in map(str, names):
            some = [r for r in rows if r.conditions.get(factor) == level]
            yield factor, level, some


HEAD = (
    "first, med+str",
    "in set",
    "set size",
    "false alarms",
    "outside unexpl.",
    "closed worse",
    "seconds",
)


def scores(rows: Sequence[Row]) -> list[str]:
    """The scores of `HEAD` over some rows."""
    single = [r for r in rows if r.group == "single"]
    visible = [r for r in single if r.strength in ("medium", "strong")]
    outside = [r for r in rows if r.group == "outside"]
    none = [r for r in rows if r.group == "none"]
    closed = [r.closed_loop for r in rows if r.verdict == "found" and r.closed_loop]
    sizes = [len(r.named) for r in single if r.named]
    return [
        _share([r.right for r in visible]),
        _share([r.effects[0] in r.named for r in visible]),
        f"{np.mean(sizes):.2f}" if sizes else "-",
        _share([r.verdict not in QUIET for r in none]),
        _share([r.verdict == "unexplained" for r in outside]),
        _share([after > before for before, after in closed]),
        f"{np.median([r.runtime_s for r in rows]):.0f}" if rows else "-",
    ]


def _share(hits: Sequence[bool]) -> str:
    """Hits and trials with their share."""
    if not hits:
        return "-"
    return f"{sum(hits)}/{len(hits)} {100.0 * sum(hits) / len(hits):.0f} %"


if __name__ == "__main__":
    read = read_rows(Path(sys.argv[1]))
    print(report(read), by_factor(read), sep="\n\n")
