"""Engines: what is trained together, and where; one interface, three of them."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from fingers_mjx.studies.sweep.plan import LOG_FILE, Key
from fingers_mjx.studies.sweep.process import WORKER, Process, worker_environment
from fingers_mjx.studies.sweep.spec import Sweep


class Job(Protocol):
    """A worker that has been started."""

    def poll(self) -> int | None:
        """Returns its exit status, negative for a signal, or None while it runs."""
        ...

    def stop(self) -> None:
        """Asks it to save and end."""
        ...


@dataclass(frozen=True)
class Engine:
    """Where members are trained.

    Attributes:
        slots: workers at the same time.
        choose: of the members that wait, those that the next worker trains.
        launch: starts a worker for members.
        close: called at the end.
    """

    slots: int
    choose: Callable[[Sequence[Key]], tuple[Key, ...]]
    launch: Callable[[Sequence[Key]], Job]
    close: Callable[[], None] = lambda: None


def one_by_one(waiting: Sequence[Key]) -> tuple[Key, ...]:
    """Returns the first member alone."""
    return tuple(waiting[:1])


def local(spec: Sweep, root: Path, command: Sequence[str] = WORKER) -> Engine:
    """Returns the engine that trains each member in a process of this machine.

    Args:
        spec: resolved; without `processes` there are as many as the cores allow.
        root: directory of the sweep, absolute.
        command: of a worker.
    """

    def launch(keys: Sequence[Key]) -> Job:
        words, log = worker_words(command, root, keys)
        environment = worker_environment(spec.threads, spec.backend)
        return Process(words, log, environment, spec.threads)

    return Engine(spec.processes or default_processes(spec), one_by_one, launch)


def default_processes(spec: Sweep) -> int:
    """Returns how many workers this machine has cores for; one where they share a GPU.

    Args:
        spec: resolved.
    """
    if spec.backend == "warp":
        return 1
    usable = getattr(os, "sched_getaffinity", None)
    cores = len(usable(0)) if usable else os.cpu_count() or 1
    return max(1, cores // (spec.threads or cores))


def worker_words(
    command: Sequence[str], root: Path, keys: Sequence[Key]
) -> tuple[list[str], Path]:
    """Returns the command line of a worker and its log, that of its first member."""
    words = [*command, str(root)]
    for key in keys:
        words += [key.configuration, str(key.seed)]
    return words, keys[0].directory(root) / LOG_FILE
