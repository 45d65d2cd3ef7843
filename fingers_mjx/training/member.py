"""A member of a population on disk: an ordinary run directory, and how it ended."""

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from envs.config.json_file import read_json
from envs.config.typed import to_dict
from envs.errors import InputError
from fingers_mjx.ppo.state import Carry
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.directory import END_FILE
from fingers_mjx.runs.files import write_whole
from fingers_mjx.runs.loggers.base import About
from fingers_mjx.runs.members import MEMBERS
from fingers_mjx.runs.setup import Setup
from fingers_mjx.training.errors import Diverged


@dataclass(frozen=True)
class Place:
    """Where a member's state goes.

    Attributes:
        name: of the member in messages and events; empty for a run of its own.
        path: run directory.
        setup: settings and hand.
        bound: what a resumed run must share.
    """

    name: str
    path: Path
    setup: Setup
    bound: Mapping[str, Any]

    @property
    def checkpoints(self) -> Path:
        """Directory of the checkpoints."""
        return self.path / "checkpoints"

    @property
    def label(self) -> dict[str, str]:
        """What marks the member's events; nothing for a run of its own."""
        return {"member": self.name} if self.name else {}

    def named(self, sentence: str) -> str:
        """Returns `sentence` with the member's name before it."""
        return f"{self.name}: {sentence}" if self.name else sentence

    def save(self, carry: Carry, iteration: int, trained_s: float, keep: int) -> Path:
        """Writes a checkpoint of the member's state and returns its path.

        Args:
            carry: its state.
            iteration: iterations done.
            trained_s: time spent on them [s].
            keep: newest checkpoints that stay.

        Raises:
            OutOfSpace: if the disk is full; earlier checkpoints are intact.
        """
        config = self.setup.train
        meta = {
            "bound": self.bound,
            "config": to_dict(config),
            "env_steps": iteration * config.steps_per_iteration,
            "trained_s": trained_s,
        }
        return checkpoint.save(self.checkpoints, iteration, carry, meta, keep)

    def note_end(self, error: Diverged) -> None:
        """Writes why the member stopped learning."""
        found = {
            "term": error.term,
            "iteration": error.iteration,
            "skipped": error.skipped,
            "dump": error.dump.name,
            "checkpoint": error.checkpoint.name if error.checkpoint else None,
        }
        text = json.dumps(found, indent=1) + "\n"
        write_whole(self.path / END_FILE, text.encode())


def about(places: Sequence[Place]) -> list[About]:
    """Returns what loggers say of members: their names inside what they share."""
    root = shared_root([place.path for place in places])
    together = len(places) > 1
    # The members of `runs/walk` are in `runs/walk/members`.
    shared = root.parent.name if root.name == MEMBERS else root.name
    return [
        About(
            place.path.absolute().relative_to(root).as_posix(),
            shared if together else "",
            to_dict({"train": place.setup.train, "env": place.setup.env}),
        )
        for place in places
    ]


def shared_root(paths: Iterable[Path]) -> Path:
    """Returns the directory inside which paths have names of their own."""
    return Path(os.path.commonpath([path.absolute().parent for path in paths]))


def read_end(path: Path) -> Diverged | None:
    """Returns why the run at `path` stopped learning, None if it did not.

    Raises:
        InputError: a file that `Place.note_end` did not write.
    """
    file = path / END_FILE
    if not file.exists():
        return None
    try:
        found = read_json(file)
        good = found["checkpoint"]
        return Diverged(
            found["term"],
            found["iteration"],
            found["skipped"],
            path / found["dump"],
            path / "checkpoints" / good if good else None,
        )
    except (ValueError, KeyError, TypeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(file, "", error, "the file that training writes") from error
