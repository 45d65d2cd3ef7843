"""Engines: what is trained together, and where; one interface, three of them."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from fingers_mjx.studies.sweep.engines.held import cores, gpus
from fingers_mjx.studies.sweep.engines.process import (
    WORKER,
    Process,
    worker_environment,
)
from fingers_mjx.studies.sweep.plan import LOG_FILE, Key
from fingers_mjx.studies.sweep.spec import Sweep


class Job(Protocol):
    """A worker that has been started."""

    def poll(self) -> int | None:
        """Returns its exit status, negative for a signal, or None while it runs."""
        ...

    def stop(self) -> None:
        """Asks it to save and end."""
        ...


Failures = Callable[[Key], int]
"""How often a member failed since the sweep was started."""
Choose = Callable[[Sequence[Key], Failures], tuple[Key, ...]]


@dataclass(frozen=True)
class Engine:
    """Where members are trained.

    Attributes:
        slots: workers at the same time.
        choose: of the members that wait, at least one, those that the next worker
            trains.
        launch: starts a worker for members.
        close: called at the end.
    """

    slots: int
    choose: Choose
    launch: Callable[[Sequence[Key]], Job]
    close: Callable[[], None] = lambda: None


def one_by_one(waiting: Sequence[Key], failures: Failures) -> tuple[Key, ...]:
    """Returns the first member alone."""
    return (waiting[0],)


def local(spec: Sweep, root: Path, command: Sequence[str] = WORKER) -> Engine:
    """Returns the engine that trains each member in a process of this machine.

    Args:
        spec: resolved; without `processes` there are as many as the cores allow.
        root: directory of the sweep, absolute.
        command: of a worker.
    """
    slots = spec.processes or default_processes(spec)
    return worker_engine(spec, root, command, slots, one_by_one)


def worker_engine(
    spec: Sweep, root: Path, command: Sequence[str], slots: int, choose: Choose
) -> Engine:
    """Returns an engine whose workers are processes of this machine.

    Args:
        spec: resolved.
        root: directory of the sweep, absolute.
        command: of a worker.
        slots: processes at the same time.
        choose: what a worker trains.
    """

    def launch(keys: Sequence[Key]) -> Job:
        words, log = worker_words(command, root, keys)
        environment = worker_environment(spec.threads, spec.backend)
        gpu = spec.backend == "warp"
        return Process(words, log, environment, spec.threads, gpu)

    return Engine(slots, choose, launch)


def default_processes(spec: Sweep) -> int:
    """Returns how many workers this machine has cores for, or GPUs, one of each.

    Args:
        spec: resolved.
    """
    if spec.backend == "warp":
        return max(1, len(gpus()))
    number = len(cores()) or os.cpu_count() or 1
    return max(1, number // (spec.threads or number))


def worker_words(
    command: Sequence[str], root: Path, keys: Sequence[Key]
) -> tuple[list[str], Path]:
    """Returns the command line of a worker and its log, that of its first member.

    The logs of the other members say where it is.
    """
    words, (first, *others) = [*command, str(root)], keys
    for key in keys:
        words += [key.configuration, str(key.seed)]
    for key in others:
        log = key.directory(root) / LOG_FILE
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("a", encoding="utf-8") as stream:
            print(f"in one program with {first}, whose log has the lines", file=stream)
    return words, first.directory(root) / LOG_FILE
