"""Progress of a sweep: a live table on a terminal, else lines of JSON.

The lines are `note` as of `fingers train`, `member` whenever the state of one changes,
and `sweep` once a minute.
"""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from rich.console import Console
from rich.live import Live

from fingers_mjx.studies.sweep.manifest import MANIFEST_FILE, Member
from fingers_mjx.studies.sweep.status import Standing, counts, standings, table
from fingers_mjx.training.progress import Event, OnProgress, Ticker

REFRESH_HZ = 0.5
LINE_EVERY_S = 60.0
"""Time between two lines on the whole sweep where they are kept [s]."""


@dataclass(frozen=True)
class Display:
    """Shows what happens in a sweep.

    Attributes:
        event: takes an event.
        member: takes a row that has changed.
    """

    event: OnProgress
    member: Callable[[Member], None]


@contextmanager
def display(stream: TextIO, root: Path) -> Iterator[Display]:
    """Yields what shows a sweep on `stream` while it runs.

    Args:
        stream: live on a terminal, else lines.
        root: directory of the sweep.
    """
    if not stream.isatty():
        with Ticker(lambda tick: _tick(stream, root), LINE_EVERY_S):
            yield Display(
                lambda event: _print(stream, event),
                lambda member: _print(stream, _row(member)),
            )
        return
    with live_table(stream, root) as console:
        yield Display(lambda event: console.print(_text(event)), lambda member: None)


@contextmanager
def live_table(stream: TextIO, root: Path) -> Iterator[Console]:
    """Keeps the table of a sweep on a terminal up to date; yields its console."""
    console = Console(file=stream)

    def picture():
        return table(_found(root))

    with Live(get_renderable=picture, console=console, refresh_per_second=REFRESH_HZ):
        yield console


def _found(root: Path) -> list[Standing]:
    """Returns how the sweep stands; nothing before it has begun."""
    return standings(root) if (root / MANIFEST_FILE).exists() else []


def _tick(stream: TextIO, root: Path) -> None:
    """Prints how all stands; a reader that is gone is met by the next other line."""
    with suppress(BrokenPipeError):
        _print(stream, _whole(root))


def _whole(root: Path) -> Event:
    found = _found(root)
    return {"event": "sweep", "text": counts(found) if found else "preparing"}


def _row(member: Member) -> Event:
    return {"event": "member", **vars(member)}


def _text(event: Event) -> str:
    return str(event.get("text", event))


def _print(stream: TextIO, event: Event) -> None:
    print(json.dumps(event), file=stream, flush=True)
