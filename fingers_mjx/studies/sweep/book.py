"""The sweep as its parent keeps it: rows of members, on the disk after every change."""

import dataclasses
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path

from fingers_mjx.runs.metrics import last_row
from fingers_mjx.studies.sweep.manifest import (
    MANIFEST_FILE,
    Manifest,
    Member,
    read_manifest,
    waiting,
    write_manifest,
)
from fingers_mjx.studies.sweep.outcome import Outcome, is_evaluated
from fingers_mjx.studies.sweep.plan import Key, keys
from fingers_mjx.studies.sweep.spec import Sweep

RETRIES = 1
"""Attempts after the first, of each start of the sweep."""

OnMember = Callable[[Member], None]


class Book:
    """Rows of all members.

    What a killed sweep had running waits again, and so does what failed: a new start of
    the sweep tries it again. What is done stays done, if its evaluation is there, and
    what has diverged stays so.

    Args:
        spec: resolved.
        root: directory of the sweep.
        on_member: called with every row that changes.
    """

    def __init__(self, spec: Sweep, root: Path, on_member: OnMember):
        self.spec, self.root, self._on_member = spec, root, on_member
        self._failures: Counter[Key] = Counter()
        self.manifest = _begun(spec, root)
        self._write()

    def add(self, more: Iterable[Key]) -> bool:
        """Adds members that are not there yet; returns whether there were any."""
        known = {m.key for m in self.manifest.members}
        new = [waiting(k, self.manifest.stages, self.root) for k in more]
        new = [m for m in new if m.key not in known]
        members = (*self.manifest.members, *new)
        self.manifest = dataclasses.replace(self.manifest, members=members)
        self._write()
        return bool(new)

    def waiting(self) -> list[Key]:
        """Returns the members to start, those that failed after all others."""
        found = [m.key for m in self.manifest.members if m.state == "waiting"]
        return sorted(found, key=lambda key: self._failures[key])

    def failures(self, key: Key) -> int:
        """Returns how often a member failed since the sweep was started."""
        return self._failures[key]

    def started(self, group: Iterable[Key]) -> None:
        """Notes that a worker has been started for members."""
        for key in group:
            member = self.member(key)
            attempts = member.attempts + 1
            self._change(member, state="running", reason="", attempts=attempts)

    def ended(self, key: Key, found: Outcome, stopping: bool) -> None:
        """Notes how a member's worker ended.

        Args:
            key: the member.
            found: how.
            stopping: whether the sweep had asked it to.
        """
        member = advanced(self.member(key), self.root, self.manifest.stages)
        state = {"done": "done", "diverged": "diverged", "failed": "failed"}
        if found.verdict in state:
            self._change(member, state=state[found.verdict], reason=found.reason)
        elif found.verdict in ("full", "anew"):
            self._change(member, state="waiting", reason=found.reason)
        elif stopping:
            self._change(member, state="waiting")
        else:
            self._failures[key] += 1
            again = self._failures[key] <= RETRIES
            state = "waiting" if again else "failed"
            self._change(member, state=state, reason=found.reason)

    def member(self, key: Key) -> Member:
        """Returns the row of a member."""
        return next(m for m in self.manifest.members if m.key == key)

    def _change(self, member: Member, **changes) -> None:
        member = dataclasses.replace(member, **changes)
        self.manifest = self.manifest.with_member(member)
        self._write()
        self._on_member(member)

    def _write(self) -> None:
        write_manifest(self.root, self.manifest)


def advanced(member: Member, root: Path, stages: Iterable[str]) -> Member:
    """Returns the row with the stage that its run directories have reached."""
    home = member.key.directory(root)
    begun = [name for name in stages if (home / name).is_dir()]
    if not begun:
        return member
    row = last_row(home / begun[-1] / "metrics.jsonl")
    done = row.get("iteration", 0)
    return dataclasses.replace(member, stage=begun[-1], iterations=done)


def _begun(spec: Sweep, root: Path) -> Manifest:
    """Returns the manifest that a start of the sweep begins with."""
    old = ()
    if (root / MANIFEST_FILE).exists():
        old = read_manifest(root).members
    stages = tuple(stage.name for stage in spec.stages)
    known = {m.key: m for m in old}
    first = [known.pop(k, None) or waiting(k, stages, root) for k in keys(spec)]
    rows = [_again(m, root, stages) for m in (*first, *known.values())]
    return Manifest(spec.task, stages, tuple(spec.configurations), tuple(rows))


def _again(member: Member, root: Path, stages: tuple[str, ...]) -> Member:
    """Returns the row of a member as a new start of the sweep sees it."""
    if is_evaluated(root / member.run):
        member = dataclasses.replace(member, state="done", reason="")
    elif member.state != "diverged":
        member = dataclasses.replace(member, state="waiting")
    return advanced(member, root, stages)
