"""What commands print and keep of an evaluation."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from fingers_mjx.evaluation.files import write_summary

WIDTH = 160
"""Room for whole names and numbers; a narrower terminal breaks the lines itself."""


def keep_summary(path: Path | None, summary: Mapping[str, Any]) -> None:
    """Writes a summary as JSON, if a path is given."""
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_summary(path, summary)


def print_measures(summary: Mapping[str, Any]) -> None:
    """Prints the measures of a summary with their 95 % intervals and percentiles."""
    title = f"{summary['policy']}: {summary['episodes']} episodes of {summary['task']}"
    header = ("measure", "mean", "95 % interval", "std", "median", "95th %", "n")
    rows = []
    for name, measure in summary["measures"].items():
        ends = (_text(measure["low"]), _text(measure["high"]))
        interval = "–" if measure["low"] is None else f"{ends[0]} – {ends[1]}"
        spread = (_text(measure[key]) for key in ("std", "median", "p95"))
        rows.append(
            (name, _text(measure["mean"]), interval, *spread, str(measure["n"]))
        )
    print_table(title, header, rows)


def print_table(
    title: str, header: Sequence[str], rows: Sequence[Sequence[str]], names: int = 1
) -> None:
    """Prints rows of text; all columns but the first `names` are set to the right."""
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for index, name in enumerate(header):
        table.add_column(name, justify="left" if index < names else "right")
    for row in rows:
        table.add_row(*row)
    Console(soft_wrap=True, highlight=False, width=WIDTH).print(table)


def _text(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"
