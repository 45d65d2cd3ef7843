"""The manifest of a sweep: one row for each member, replaced as a whole."""

import dataclasses
import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from envs.config.json_file import read_json
from envs.config.typed import from_dict, to_dict
from envs.errors import InputError
from fingers_deploy.files import is_folder
from fingers_mjx.runs.files import write_whole
from fingers_mjx.studies.sweep.plan import Key

MANIFEST_FILE = "sweep.json"
FORMAT = 1
State = Literal["waiting", "running", "done", "failed", "diverged"]


@dataclass(frozen=True)
class Member:
    """One member as it stands.

    Attributes:
        configuration: its name.
        seed: of its trainings.
        state: "diverged" is not trained again: the same seed diverges again, or has
            done so on a GPU.
        reason: why it failed or diverged; of a member that waits, why it does again.
        attempts: how often it was started.
        stage: the one reached.
        iterations: done in that stage.
        run: run directory of its last stage, relative to the sweep.
    """

    configuration: str
    seed: int
    state: State
    reason: str
    attempts: int
    stage: str
    iterations: int
    run: str

    @property
    def key(self) -> Key:
        """Configuration and seed."""
        return Key(self.configuration, self.seed)

    @property
    def over(self) -> bool:
        """Whether nothing more is to be done for it by itself."""
        return self.state not in ("waiting", "running")


@dataclass(frozen=True)
class Manifest:
    """All members of a sweep.

    Attributes:
        task: registered name.
        stages: names in turn.
        configurations: names in the order of the specification.
        members: one row each.
        format: of the file.
    """

    task: str
    stages: tuple[str, ...]
    configurations: tuple[str, ...]
    members: tuple[Member, ...]
    format: int = field(default=FORMAT, metadata={"low": FORMAT, "high": FORMAT})

    def with_member(self, member: Member) -> "Manifest":
        """Returns the manifest with one row replaced."""
        rows = [member if m.key == member.key else m for m in self.members]
        return dataclasses.replace(self, members=tuple(rows))

    def missing(self) -> list[Member]:
        """Returns the members that are not done."""
        return [m for m in self.members if m.state != "done"]


def waiting(key: Key, stages: Iterable[str], root: Path) -> Member:
    """Returns the row of a member of which nothing has been done."""
    names = list(stages)
    run = key.directory(root).relative_to(root) / names[-1]
    return Member(*key, "waiting", "", 0, names[0], 0, run.as_posix())


def number_of(members: int) -> str:
    """Returns a number of members in words."""
    return f"{members} member" + "s" * (members != 1)


def read_manifest(directory: Path) -> Manifest:
    """Reads the manifest of a sweep directory.

    Raises:
        InputError: there is none, or not one that this version writes.
    """
    path = directory / MANIFEST_FILE
    is_folder(directory)
    if not path.exists():
        raise InputError(path, "", "no sweep", "what fingers sweep writes")
    return from_dict(Manifest, read_json(path), path)


def write_manifest(directory: Path, manifest: Manifest) -> None:
    """Replaces the manifest of a sweep directory as a whole.

    Raises:
        OutOfSpace: the disk is full; the old manifest is intact.
    """
    text = json.dumps(to_dict(manifest), indent=1) + "\n"
    write_whole(directory / MANIFEST_FILE, text.encode())
