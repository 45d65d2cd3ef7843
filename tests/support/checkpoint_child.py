"""Saves checkpoints and kills itself at named points: python checkpoint_child.py DIR N.

For each point, N times over, a forked process saves iterations 1, 2 and 3 into a
directory of its own and takes SIGKILL at that point of the third save. A busy machine
may look for a file too late; then the save was over, and the trial is made again.
"""

import os
import shutil
import signal
import sys
import threading
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from fingers_mjx.runs import checkpoint

STEPS = {
    "begin": "to_host",
    "made": "_make",
    "state written": "_write_state",
    "meta written": "_write_notes",
    "sealed": "seal",
    "name free": "_free",
    "renamed": "_rename",
    "committed": "sync",
    "hidden": "_hide",
    "deleted": "_delete",
}
"""Points of the protocol, and the step of `checkpoint.save` that each comes after."""
PROTOCOL = tuple(STEPS)
FILES = {"amid the arrays": "state*/**/*", "amid the manifest": "manifest.json"}
"""Points between those of the protocol: as soon as such a file is there."""
POINTS = (*PROTOCOL, *FILES)
MISSED, TRIALS = 3, 50


@contextmanager
def watched_steps(reached):
    """Calls `reached` with the name of each point as a save gets there."""

    def followed(step, point):
        def call(*args):
            result = step(*args)
            reached(point)
            return result

        return call

    plain = {name: getattr(checkpoint, name) for name in STEPS.values()}
    for point, name in STEPS.items():
        setattr(checkpoint, name, followed(plain[name], point))
    try:
        yield
    finally:
        for name, step in plain.items():
            setattr(checkpoint, name, step)


def state(number):
    return {"a": np.arange(2**20) + number, "b": {"c": np.float32(number)}}


def kill():
    os.kill(os.getpid(), signal.SIGKILL)


def kill_when(directory, pattern, over):
    """Kills this process when a file appears in the unfinished checkpoint."""
    while not over.is_set():
        if any(p.is_file() for p in directory.glob(f".tmp-*/{pattern}")):
            kill()


def save_and_die(directory, point):
    directory.mkdir()
    for number in (1, 2):
        checkpoint.save(directory, number, state(number), {}, keep=2)
    over = threading.Event()
    if point in FILES:
        watched = (directory, FILES[point], over)
        threading.Thread(target=kill_when, args=watched).start()
    at = {point: kill}
    with watched_steps(lambda reached: at.get(reached, bool)()):
        checkpoint.save(directory, 3, state(3), {}, 2)
    over.set()


def killed(directory, point):
    """Lets a forked process save and die; returns whether it died at the point."""
    child = os.fork()
    if child == 0:
        save_and_die(directory, point)
        os._exit(MISSED)
    _, status = os.waitpid(child, 0)
    if os.WIFEXITED(status) and os.WEXITSTATUS(status) == MISSED and point in FILES:
        shutil.rmtree(directory)
        return False
    if not os.WIFSIGNALED(status) or os.WTERMSIG(status) != signal.SIGKILL:
        sys.exit(f"{point}: not killed, status {status}")
    return True


def main(root, repeats):
    for point in POINTS:
        for trial in range(repeats):
            directory = root / f"{point}-{trial}"
            if not any(killed(directory, point) for _ in range(TRIALS)):
                sys.exit(f"{point}: missed {TRIALS} times")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
