"""What a logger is: it takes the rows and videos of a curve, one after the other."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

Row = Mapping[str, Any]
STEP, TIME = "iteration", "time_s"
"""What every row has: iterations done, and seconds since 1970."""


@dataclass(frozen=True)
class Kept:
    """What a run has when its curve is opened: nothing, or what it goes on from.

    Attributes:
        directory: of the run.
        rows: of the curve so far.
        videos: of the policy so far, by iteration.
    """

    directory: Path
    rows: Sequence[Row]
    videos: Mapping[int, Path]


class Logger(Protocol):
    """One place to which a curve goes."""

    def append(self, row: Row) -> None:
        """Adds one row."""
        ...

    def append_video(self, iteration: int, path: Path) -> None:
        """Adds a video of the policy, a GIF."""
        ...

    def close(self) -> None:
        """Writes what is left."""
        ...


Open = Callable[[Kept], Logger]
"""Opens a logger; it begins with what the run has."""


@dataclass(frozen=True)
class About:
    """What a logger that shows many runs says of one.

    Attributes:
        name: of the run.
        group: of runs that were trained together; empty for a run of its own.
        config: its settings as plain data.
    """

    name: str
    group: str
    config: Mapping[str, Any]


def numbers(row: Row) -> dict[str, float]:
    """Returns the figures of a row: without its place on the axes, without text."""
    figures = {k: v for k, v in row.items() if isinstance(v, int | float)}
    return {k: float(v) for k, v in figures.items() if k not in (STEP, TIME)}
