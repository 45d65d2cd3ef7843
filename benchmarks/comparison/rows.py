"""Rows of the comparison: one measured figure with all that is needed to repeat it."""

import dataclasses
import json
import math
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Row:
    """One figure, or the reason why there is none.

    Attributes:
        job: the measurement, unique among rows together with `peer`.
        peer: what was measured.
        version: of it and of what its figure depends on.
        quantity: what the figure is.
        unit: of it.
        value: the figure; nothing where it could not be taken.
        low: lower end of its interval, or nothing.
        high: upper end of its interval, or nothing.
        note: what a reader must know: the task, or why there is no figure.
        command: that takes it.
        seed: of all that is drawn.
        device: on which it was taken.
        commit: of this repository.
    """

    job: str
    peer: str
    version: str
    quantity: str
    unit: str
    value: float | None
    low: float | None = None
    high: float | None = None
    note: str = ""
    command: str = ""
    seed: int = 0
    device: str = ""
    commit: str = ""

    def __post_init__(self):
        figures = [x for x in (self.value, self.low, self.high) if x is not None]
        if not all(math.isfinite(x) for x in figures):
            raise ValueError(f"{self.job}, {self.peer}: a figure is not finite")
        if self.value is None and not self.note:
            raise ValueError(f"{self.job}, {self.peer}: neither a figure nor a reason")


def read_rows(path: Path) -> list[Row]:
    """Reads a file of rows, one JSON object a line; none if there is no file.

    A last line that was cut off by an end of the process is left out.
    """
    if not path.exists():
        return []
    lines = path.read_text(encoding="utf-8").split("\n")
    return [Row(**json.loads(line)) for line in lines[:-1] if line]


def add_rows(path: Path, rows: list[Row]) -> None:
    """Writes rows behind those that the file has, after dropping a line cut off."""
    kept = read_rows(path)
    text = "".join(json.dumps(dataclasses.asdict(r)) + "\n" for r in [*kept, *rows])
    partial = path.with_suffix(".part")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)


def lacking(rows: list[Row], job: str, device: str) -> bool:
    """Whether no figure of a measurement was taken on a device yet."""
    return not any(row.job == job and row.device == device for row in rows)
