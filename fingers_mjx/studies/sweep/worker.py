"""A process that trains and evaluates members: python -m … ROOT NAME SEED [NAME …].

Its exit status is that of `fingers train`. It ends at once when its standard input is
closed, which the process that started it holds open: so no worker outlives a sweep that
was killed, and no two ever write to one member.
"""

import json
import os
import sys
import threading
import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path

from envs.errors import InputError
from fingers_mjx.runs.directory import locked
from fingers_mjx.studies.sweep.member import evaluate_members, train_members
from fingers_mjx.studies.sweep.outcome import CRASHED, forget_outcome, note_outcome
from fingers_mjx.studies.sweep.plan import Key
from fingers_mjx.studies.sweep.resolve import SPEC_FILE, saved_sweep
from fingers_mjx.studies.sweep.spec import Sweep
from fingers_mjx.training.errors import exit_status
from fingers_mjx.training.progress import Event, OnProgress

LOCK_FILE = "member.lock"
LOCK_WAIT_S = 30.0
"""Time in which a worker whose sweep was killed has ended [s]."""

TrainMembers = Callable[[Sweep, Path, Sequence[Key], OnProgress], dict[Key, Exception]]
EvaluateMembers = Callable[[Sweep, Path, Sequence[Key]], dict[Key, Exception]]


def main(
    argv: Sequence[str],
    train: TrainMembers = train_members,
    evaluate: EvaluateMembers = evaluate_members,
) -> int:
    """Trains and evaluates members, and returns the exit status.

    Args:
        argv: directory of the sweep, then configuration and seed of each member.
        train: trains members, and returns those that ended on their own.
        evaluate: evaluates those that were trained, and returns those that failed.
    """
    root, words = Path(argv[0]), argv[1:]
    keys = [Key(n, int(s)) for n, s in zip(words[::2], words[1::2], strict=True)]
    spec = saved_sweep(root)
    if spec is None:
        raise InputError(root / SPEC_FILE, "", "nothing", "a sweep")
    lost: dict[Key, Exception] = {}

    def all_of(do: Callable[[Sequence[Key]], dict[Key, Exception]]) -> int:
        left = [key for key in keys if key not in lost]
        return _attempted(root, left, lambda: lost.update(do(left)))

    with ExitStack() as stack:
        for key in keys:
            _hold(stack, key.directory(root))
            forget_outcome(root, key)
        status = all_of(lambda left: train(spec, root, left, say))
        status = status or all_of(partial(evaluate, spec, root))
        alone = [_attempted(root, [k], _raising(error)) for k, error in lost.items()]
        return status or max(alone, default=0)


def say(event: Event) -> None:
    """Prints an event as a line of JSON; the rows of the curve have their own file."""
    if event["event"] != "progress":
        print(json.dumps(event), flush=True)


def end_with_parent() -> None:
    """Ends the process as soon as its standard input is closed."""

    def wait() -> None:
        while os.read(0, 1):
            pass
        os._exit(CRASHED)

    threading.Thread(target=wait, daemon=True).start()


def _attempted(root: Path, keys: Sequence[Key], do: Callable[[], None]) -> int:
    """Does something for members; notes an error and returns its exit status."""
    try:
        do()
        return 0
    except Exception as error:
        status, reason = exit_status(error), " ".join(str(error).split())
        if status is None:
            traceback.print_exc()
            status, reason = CRASHED, f"{type(error).__name__}: {reason}"
        print(reason, flush=True)
        for key in keys:
            with suppress(OSError):  # a full disk takes not even this
                note_outcome(root, key, status, reason)
        return status


def _raising(error: Exception) -> Callable[[], None]:
    def do() -> None:
        raise error

    return do


def _hold(stack: ExitStack, directory: Path) -> None:
    """Locks a member; waits for a worker that is about to end."""
    directory.mkdir(parents=True, exist_ok=True)
    valid = "a member that no other process is training"
    stack.enter_context(locked(directory / LOCK_FILE, valid, LOCK_WAIT_S))


if __name__ == "__main__":
    end_with_parent()
    sys.exit(main(sys.argv[1:]))
