"""Files of a comparison: everything as JSON, differences and values as Parquet."""

import dataclasses
import json
from pathlib import Path
from typing import Any

from envs.config.atomic_file import write_atomic
from fingers_mjx.evaluation.files import write_columns
from fingers_mjx.reports.page import commit_here
from fingers_mjx.studies.comparison.comparison import Comparison

JSON_FILE, TABLE_FILE, VALUES_FILE = (
    "comparison.json",
    "comparison.parquet",
    "values.parquet",
)
FORMAT = 1


def document(comparison: Comparison) -> dict[str, Any]:
    """Returns the comparison for JSON; an undefined number is None.

    Args:
        comparison: of a sweep.
    """
    results = comparison.results
    return {
        "format": FORMAT,
        "task": results.task,
        "baseline": comparison.baseline,
        "configurations": list(results.configurations),
        "measures": list(comparison.measures),
        "read_together": len(comparison.rows),
        "commit": commit_here(),
        "evaluation": dict(results.conditions),
        "chose": {k: list(v) for k, v in results.chose.items()},
        "trained_anew": {k: list(v) for k, v in results.anew.items()},
        "missing": [dataclasses.asdict(missing) for missing in comparison.missing],
        "differences": [dataclasses.asdict(row) for row in comparison.rows],
        "arms": [dataclasses.asdict(cell) for cell in comparison.cells],
    }


def write_comparison(directory: Path, comparison: Comparison) -> None:
    """Writes JSON and the two tables.

    Args:
        directory: made if missing; other files in it stay.
        comparison: of a sweep.
    """
    directory.mkdir(parents=True, exist_ok=True)
    about = {"task": comparison.results.task, "baseline": comparison.baseline}
    write_columns(directory / TABLE_FILE, _differences(comparison), about)
    write_columns(directory / VALUES_FILE, _values(comparison), about)
    text = json.dumps(document(comparison), indent=2, allow_nan=False) + "\n"
    write_atomic(directory / JSON_FILE, text)


def _differences(comparison: Comparison) -> dict[str, list]:
    """One row for each measure of each configuration but the baseline."""
    rows = []
    for row in comparison.rows:
        flat = dataclasses.asdict(row)
        rows.append(flat | flat.pop("difference"))
    return {name: [row[name] for row in rows] for name in rows[0]}


def _values(comparison: Comparison) -> dict[str, Any]:
    """One row for each measure of each member."""
    rows = [
        (cell.configuration, cell.measure, seed, value)
        for cell in comparison.cells
        for seed, value in cell.values.items()
    ]
    names = ("configuration", "measure", "seed", "value")
    columns = zip(*rows, strict=True) if rows else [()] * len(names)
    return {n: list(c) for n, c in zip(names, columns, strict=True)}
