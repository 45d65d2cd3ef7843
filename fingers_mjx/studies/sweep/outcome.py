"""How a worker ended, from its exit status and what it left behind."""

import json
import signal
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from envs.config.atomic_file import write_atomic
from envs.config.json_file import read_table
from envs.errors import BAD_INPUT, InputError
from fingers_mjx.evaluation.files import SUMMARY_FILE
from fingers_mjx.runs.files import OutOfSpace
from fingers_mjx.studies.sweep.divergence import diverged_once
from fingers_mjx.studies.sweep.plan import LOG_FILE, Key
from fingers_mjx.training.errors import Diverged, Interrupted

OUTCOME_FILE = "outcome.json"
CRASHED = 1
"""Exit status of a worker that met a fault; the others are those of the errors."""
LOG_BYTES = 1 << 14

Verdict = Literal["done", "again", "anew", "failed", "diverged", "full"]


@dataclass(frozen=True)
class Outcome:
    """What became of a member when its worker ended.

    Attributes:
        verdict: "again" is a failure that another attempt may not have, "failed" one
            that it would have again; "anew" is a first divergence of a stage where
            another training of the same seed may do better.
        reason: in one sentence; empty if it is done.
    """

    verdict: Verdict
    reason: str = ""


def is_evaluated(run: Path) -> bool:
    """Whether the evaluation of a run is complete; its summary is written last."""
    return (run / "eval" / SUMMARY_FILE).is_file()


def note_outcome(root: Path, key: Key, status: int, reason: str) -> None:
    """Leaves behind, in the worker, how a member ended; status as of a process."""
    text = json.dumps({"status": status, "reason": reason}) + "\n"
    write_atomic(key.directory(root) / OUTCOME_FILE, text)


def forget_outcome(root: Path, key: Key) -> None:
    """Removes what an earlier attempt has left behind."""
    (key.directory(root) / OUTCOME_FILE).unlink(missing_ok=True)


def outcome(
    root: Path, key: Key, run: Path, status: int, repeatable: bool = True
) -> Outcome:
    """Returns what became of a member.

    Args:
        root: directory of the sweep.
        key: the member.
        run: its last run directory.
        status: exit status of its worker; negative if a signal ended it.
        repeatable: whether the same seed gives the same training, as it does on the
            CPU: then one that diverged would do so again.
    """
    if is_evaluated(run):
        return Outcome("done")
    noted = _noted(key.directory(root) / OUTCOME_FILE)
    status, reason = noted.get("status", status), noted.get("reason", "")
    if status == Diverged.exit_code and repeatable:
        return Outcome("diverged", f"{reason}; the same seed would diverge again")
    if status == Diverged.exit_code:
        first = diverged_once(key.directory(root))
        return Outcome("anew" if first else "diverged", reason)
    if status == BAD_INPUT:
        return Outcome("failed", reason)
    if status == OutOfSpace.exit_code:
        return Outcome("full", reason)
    return Outcome("again", reason or _without_words(root, key, status))


def last_lines(root: Path, key: Key, number: int) -> list[str]:
    """Returns the last lines of a member's log that are not empty."""
    path = key.directory(root) / LOG_FILE
    if not path.exists():
        return []
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - LOG_BYTES))
        text = file.read().decode(errors="replace")
    return [line for line in text.splitlines() if line.strip()][-number:]


def _noted(path: Path) -> Mapping[str, Any]:
    try:
        return read_table(path)
    except InputError:
        return {}


def _without_words(root: Path, key: Key, status: int) -> str:
    """Returns the reason of a worker that could not say it."""
    last = " | ".join(last_lines(root, key, 1)) or "nothing"
    if status == -signal.SIGKILL:
        return f"killed by SIGKILL, as when memory runs out; last line: {last}"
    if status < 0:
        return f"killed by {signal.Signals(-status).name}; last line: {last}"
    if status == Interrupted.exit_code:
        hung = next((x for x in last_lines(root, key, 400) if "no progress" in x), "")
        return f"hung: {hung}" if hung else f"stopped by a signal; last line: {last}"
    return f"ended with status {status}; last line: {last}"
