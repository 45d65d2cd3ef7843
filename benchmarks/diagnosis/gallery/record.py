"""A public record: where it is, what its authors say, and how it becomes a log."""

import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from envs.errors import InputError
from sysid.logs.log import MeasuredLog
from sysid.mechanism import Mechanism

Made = tuple[Sequence[MeasuredLog], Mechanism]
Read = Callable[[str], bytes]
"""From a path inside the repository to the contents of the file."""


@dataclass(frozen=True)
class Record:
    """One entry of the gallery.

    Attributes:
        name: short name.
        robot: what was measured.
        repository: owner and name on GitHub.
        commit: that is read.
        licence: of the repository; "none" where it has none.
        half: `first`, for development, or `second`, for one look at the end.
        effects: names in the catalogue of the documented cause; one of them in the
            named set is right.
        documented: what the authors say, in our words.
        where: where they say it.
        made: makes logs and the nominal mechanism from the repository's files.
        remark: what is to be said of the verdict, written after it.
    """

    name: str
    robot: str
    repository: str
    commit: str
    licence: str
    half: str
    effects: tuple[str, ...]
    documented: str
    where: str
    made: Callable[[Read], Made]
    remark: str = ""

    def clone(self, folder: Path) -> Path:
        """Returns where the clone of its repository is or should be."""
        return folder / f"{self.repository}.git"

    def reader(self, folder: Path) -> Read:
        """Returns a function that reads files of its commit.

        Raises:
            InputError: there is no clone, or it lacks a file.
        """
        clone = self.clone(folder)
        if not clone.is_dir():
            valid = f"a clone of github.com/{self.repository}; --fetch makes one"
            raise InputError(clone, "", "no such folder", valid)

        def read(path: str) -> bytes:
            command = ["git", f"--git-dir={clone}", "show", f"{self.commit}:{path}"]
            done = subprocess.run(command, capture_output=True, check=False)
            if done.returncode:
                said = done.stderr.decode().strip()
                raise InputError(clone, path, said, f"a file of {self.commit}")
            return done.stdout

        return read

    def fetch(self, folder: Path) -> None:
        """Clones its repository, if it is not there."""
        if not self.clone(folder).is_dir():
            self.clone(folder).parent.mkdir(parents=True, exist_ok=True)
            url = f"https://github.com/{self.repository}"
            subprocess.run(
                ["git", "clone", "--quiet", "--bare", url, self.clone(folder)],
                check=True,
            )
