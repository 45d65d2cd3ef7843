"""Which checkpoints there are, and which of them are intact.

None is read for it, so that a run without one is refused before JAX loads.
"""

from collections.abc import Callable
from pathlib import Path

from envs.errors import InputError
from fingers_mjx.runs.seal import problem


def checkpoints(directory: Path) -> list[Path]:
    """Returns the checkpoints in `directory`, oldest first."""
    return sorted(p for p in directory.glob("[0-9]" * 8) if p.is_dir())


def newest(
    directory: Path, say: Callable[[str], None], at_most: int | None = None
) -> Path | None:
    """Returns the newest checkpoint that is intact; None if none was ever written.

    Args:
        directory: of all checkpoints of the run.
        say: called with one sentence for each checkpoint that is passed over.
        at_most: last iteration that it may be of; any if not given.

    Raises:
        InputError: if there are checkpoints, but none is intact.
    """
    found = checkpoints(directory)
    if at_most is not None:
        found = [path for path in found if int(path.name) <= at_most]
    for path in reversed(found):
        fault = problem(path, int(path.name))
        if not fault:
            return path
        say(f"checkpoint {path} is damaged ({fault}); trying the one before it")
    if found:
        raise InputError(directory, "", "only damaged checkpoints", "an intact one")
    return None


def newest_at(path: Path, say: Callable[[str], None]) -> Path:
    """Returns the newest intact checkpoint of a run directory, or `path`, if it is one.

    Args:
        path: run directory or checkpoint.
        say: as of `newest`.

    Raises:
        InputError: if there is none.
    """
    inside = path / "checkpoints"
    if not inside.is_dir():
        check(path)
        return path
    found = newest(inside, say)
    if found is None:
        raise InputError(inside, "", "no checkpoint", "a run that has saved one")
    return found


def check(path: Path) -> None:
    """Checks every byte of a checkpoint.

    Raises:
        InputError: if it is missing, incomplete or altered.
    """
    if not (path.name.isdigit() and path.is_dir()):
        found = "another name or no directory"
        raise InputError(path, "", found, "a checkpoint, checkpoints/NNNNNNNN")
    if fault := problem(path, int(path.name)):
        raise InputError(path, "", fault, "a complete checkpoint")
