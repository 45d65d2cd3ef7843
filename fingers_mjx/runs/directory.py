"""Run directory: one writer at a time, and what anything can be rebuilt from.

config.yaml     resolved configuration
hand.yaml       the hand
run.json        what a resumed run must share, and the format of this directory
versions.json   packages, Python, platform, machine, commit (no host or user names)
metrics.jsonl   learning curve; events.out.tfevents.0: the same for TensorBoard
checkpoints/    whole training states
eval/           evaluations
"""

from __future__ import annotations

import fcntl
import json
import os
import platform
import subprocess
import time
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from envs.config.atomic_file import PARTIAL
from envs.config.json_file import read_table
from envs.config.typed import dump_yaml
from envs.errors import InputError
from fingers_deploy.files import is_folder
from fingers_mjx.runs.files import write_whole
from fingers_mjx.runs.machine import machine

if TYPE_CHECKING:
    from envs.hand.hand_file import HandFile

FORMAT = 1
LOCK = "run.lock"
RUN_FILE = "run.json"
CONFIG_FILE = "config.yaml"
VERSIONS_FILE = "versions.json"
HAND_FILE = "hand.yaml"
END_FILE = "diverged.json"
"""Why a run diverged; only in one that did."""
LOCK_WAIT_S = 1.0
"""Time for which a lock is tried: `is_locked` holds it for an instant [s]."""
PACKAGES = (
    "fingers-mjx",
    "jax",
    "jaxlib",
    "brax",
    "flax",
    "optax",
    "orbax-checkpoint",
    "mujoco",
    "mujoco-mjx",
    "mujoco-warp",
    "warp-lang",
    "numpy",
)


@contextmanager
def open_run(path: Path, resume: bool) -> Iterator[Path]:
    """Makes (or with `resume` opens) the run directory `path` and locks it.

    Yields:
        the directory, absolute, with its subdirectories.

    Raises:
        InputError: if a new run would write over something, if there is no run to
            resume, or if another process is writing to it.
    """
    path = path.absolute()
    _check_purpose(path, resume)
    for directory in (path, path / "checkpoints", path / "eval"):
        directory.mkdir(parents=True, exist_ok=True)
    with locked(path / LOCK, "a run that no other process is writing to"):
        _check_purpose(path, resume)
        yield path


def record_run(
    path: Path,
    config: Mapping[str, Any],
    bound: Mapping[str, Any],
    hand: HandFile | None = None,
) -> None:
    """Writes configuration, hand, versions and what a resumed run must share."""
    from envs.hand.hand_file import hand_yaml

    text = dump_yaml(config)
    if hand is not None:
        write_whole(path / HAND_FILE, hand_yaml(hand).encode())
    write_whole(path / VERSIONS_FILE, _json(versions()))
    write_whole(path / RUN_FILE, _json({"format": FORMAT, "bound": bound}))
    write_whole(path / CONFIG_FILE, text.encode())


def saved_bound(path: Path) -> dict[str, Any]:
    """Returns what a resumed run must share with the run at `path`, by nested names.

    Raises:
        InputError: if `path` is not a run directory that this version can read.
    """
    bound = _read_run(path).get("bound")
    if not isinstance(bound, dict):
        raise InputError(path / RUN_FILE, "bound", bound, "a mapping")
    return bound


def check_bound(
    path: Path,
    current: Mapping[str, Any],
    free: Collection[str] = (),
    defaults: Mapping[str, Any] | None = None,
) -> None:
    """Raises InputError if the run at `path` was made with something else.

    Args:
        path: of the run.
        current: nested names and values that must be the same.
        free: dotted names of values that may differ all the same.
        defaults: nested names and values of settings that a run may be older than: it
            did what they do unless they are set.

    Raises:
        InputError: naming the first field that differs, its saved and current value.
    """
    saved, now = flat(saved_bound(path)), flat(json.loads(_json(current)))
    older = flat(json.loads(_json(defaults or {})))
    for name in sorted((saved.keys() | now.keys()) - set(free)):
        was = saved.get(name, older.get(name, "nothing"))
        found = now.get(name, "nothing")
        if was != found:
            valid = f"{was} as saved (--warm-start takes the policy across)"
            raise InputError(path, name, found, valid)


def versions() -> dict[str, Any]:
    """Returns packages, Python, platform, machine, and the commit if any."""
    packages = {name: _version(name) for name in PACKAGES}
    return {
        "packages": {k: v for k, v in packages.items() if v},
        "python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
        "machine": machine(),
        "commit": _commit(),
    }


def _check_purpose(path: Path, resume: bool) -> None:
    """Raises InputError if `path` does not suit a new run, or one to resume."""
    if resume:
        _read_run(path)
        return
    if path.exists() and not path.is_dir():
        raise InputError(path, "", "a file", "a directory to make")
    ours = {LOCK, "checkpoints", "eval", HAND_FILE, VERSIONS_FILE, RUN_FILE}
    names = {p.name for p in path.iterdir()} if path.exists() else set()
    if any(name not in ours and not name.startswith(PARTIAL) for name in names):
        valid = "a new or empty directory (--resume goes on with a run)"
        raise InputError(path, "", "a directory in use", valid)


def _read_run(path: Path) -> dict[str, Any]:
    """Returns `run.json` of a complete run directory of this format."""
    is_folder(path)
    if not all((path / name).exists() for name in (RUN_FILE, CONFIG_FILE)):
        raise InputError(path, "", "no run", "a directory made by fingers train")
    try:
        run = read_table(path / RUN_FILE)
    except InputError as error:
        valid = "the file of a run, made by fingers train"
        raise InputError(path / RUN_FILE, "", error.found, valid) from error
    if run.get("format") != FORMAT:
        found = run.get("format", "nothing")
        raise InputError(path / RUN_FILE, "format", found, str(FORMAT))
    return run


@contextmanager
def locked(path: Path, valid: str, wait_s: float | None = None) -> Iterator[None]:
    """Holds the lock file `path`; the system frees it however the process ends.

    Args:
        path: the file, which stays.
        valid: what would be valid where another process holds it.
        wait_s: how long it is tried; `LOCK_WAIT_S` if not given [s].

    Raises:
        InputError: another process holds it; names the directory of `path`.
    """
    handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        if not _taken(handle, LOCK_WAIT_S if wait_s is None else wait_s):
            raise InputError(path.parent, "", "a run in progress", valid)
        yield
    finally:
        os.close(handle)


def _taken(handle: int, wait_s: float) -> bool:
    """Locks an open file; whether nobody else held it all the time."""
    last_s = time.monotonic() + wait_s
    while True:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            if time.monotonic() > last_s:
                return False
            time.sleep(0.02)


def is_locked(path: Path) -> bool:
    """Whether another process holds the lock file `path`; nothing is written."""
    try:
        handle = os.open(path, os.O_RDONLY)
    except FileNotFoundError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(handle)
    return False


def flat(tree: Any, prefix: str = "") -> dict[str, Any]:
    """Returns the leaves of nested mappings by dotted name."""
    if not isinstance(tree, Mapping):
        return {prefix: tree}
    found: dict[str, Any] = {}
    for name, value in tree.items():
        found |= flat(value, f"{prefix}.{name}" if prefix else name)
    return found


def _json(value: Any) -> bytes:
    """Returns `value` as indented JSON."""
    return (json.dumps(value, indent=1) + "\n").encode()


def _version(package: str) -> str:
    """Returns the installed version of `package`, or an empty string."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""


def _commit() -> str:
    """Returns the commit of the source tree, or an empty string if it has none."""
    here = Path(__file__).parents[1]
    command = ["git", "-C", str(here), "rev-parse", "HEAD"]
    try:
        done = subprocess.run(command, capture_output=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.decode().strip()
