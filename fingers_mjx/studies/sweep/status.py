"""How a sweep stands: manifest and learning curves of its members, as table or JSON."""

import dataclasses
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from fingers_mjx.runs.directory import is_locked
from fingers_mjx.runs.metrics import last_row
from fingers_mjx.studies.sweep.book import advanced
from fingers_mjx.studies.sweep.manifest import Member, number_of, read_manifest
from fingers_mjx.studies.sweep.resolve import LOCK_FILE
from fingers_mjx.training.progress_table import clock, shown

COLORS = {
    "running": "cyan",
    "failed": "red",
    "diverged": "red",
    "waiting": "",
    "done": "green",
}
"""Colours of the states, in the order in which a table shows them."""
STOPPED = "stopped; the same command goes on"
"""Why a member waits that ran when its sweep ended."""


@dataclass(frozen=True)
class Standing:
    """A member as it stands.

    Attributes:
        member: its row; of one that runs, as far as its learning curve has come.
        iterations: of the stage, None before the first row of the curve.
        steps_per_s: control steps per second, None unless it is training.
        eta_s: until the end of the stage [s], None unless it is training.
    """

    member: Member
    iterations: int | None
    steps_per_s: float | None
    eta_s: float | None

    def event(self) -> dict[str, Any]:
        """Returns it as an event."""
        row = dataclasses.asdict(self.member)
        return {
            "event": "member",
            **row,
            "of_iterations": self.iterations,
            "steps_per_s": self.steps_per_s,
            "eta_s": self.eta_s,
        }


def standings(root: Path) -> list[Standing]:
    """Returns how the members of a sweep stand.

    What a killed sweep had running waits for the next start.

    Raises:
        InputError: there is no sweep.
    """
    manifest = read_manifest(root)
    members = list(manifest.members)
    if not in_progress(root):
        members = [_stopped(m, root, manifest.stages) for m in members]
    return [_standing(root, member, manifest.stages) for member in members]


def in_progress(root: Path) -> bool:
    """Whether a process works on the sweep, in whose directory nothing is written."""
    return is_locked(root / LOCK_FILE)


def table(found: list[Standing]) -> RenderableType:
    """Returns the table of a sweep: first what runs or failed, last what is done."""
    table = Table(box=None, pad_edge=False, expand=True)
    for name in ("member", "state", "stage"):
        table.add_column(name, no_wrap=True)
    for name in ("iteration", "steps/s", "ETA"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("reason", overflow="ellipsis", no_wrap=True, ratio=1)
    order = list(COLORS)
    for one in sorted(found, key=lambda one: order.index(one.member.state)):
        member = one.member
        state = Text(member.state, style=COLORS[member.state])
        numbers = _numbers(one)
        table.add_row(str(member.key), state, member.stage, *numbers, member.reason)
    return Group(Text(counts(found)), table)


def counts(found: list[Standing]) -> str:
    """Returns how many members are in each state, and how fast all train together."""
    number = Counter(one.member.state for one in found)
    words = [f"{number[state]} {state}" for state in COLORS if number[state]]
    speed = sum(one.steps_per_s or 0.0 for one in found)
    words += [f"{speed:,.0f} steps/s"] if speed else []
    return f"{number_of(len(found))}: {', '.join(words)}"


def _stopped(member: Member, root: Path, stages: tuple[str, ...]) -> Member:
    """Returns a member of a sweep on which no process works."""
    if member.state != "running":
        return member
    member = advanced(member, root, stages)
    return dataclasses.replace(member, state="waiting", reason=STOPPED)


def _standing(root: Path, member: Member, stages: tuple[str, ...]) -> Standing:
    """Returns a member as its learning curve says."""
    if member.state == "running":
        member = advanced(member, root, stages)
    curve = member.key.directory(root) / member.stage / "metrics.jsonl"
    row = last_row(curve)
    training = member.state == "running" and bool(row.get("eta_s"))
    return Standing(
        member,
        row.get("iterations"),
        row.get("steps_per_s") if training else None,
        row.get("eta_s") if training else None,
    )


def _numbers(one: Standing) -> list[str]:
    """Returns the columns of numbers as text."""
    of = f"/{one.iterations}" if one.iterations else ""
    return [
        f"{one.member.iterations}{of}",
        shown(one.steps_per_s) if one.steps_per_s else "",
        clock(one.eta_s) if one.eta_s else "",
    ]
