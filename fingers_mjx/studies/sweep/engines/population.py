"""The engine `population`: many members as one program of one process."""

import json
from collections.abc import Sequence
from pathlib import Path

from fingers_mjx.runs import checkpoint
from fingers_mjx.studies.sweep.divergence import begins_again
from fingers_mjx.studies.sweep.engines.engine import (
    Engine,
    Failures,
    default_processes,
    worker_engine,
)
from fingers_mjx.studies.sweep.engines.held import gpu_facts
from fingers_mjx.studies.sweep.engines.process import WORKER
from fingers_mjx.studies.sweep.plan import Key, Training, keys, trainings
from fingers_mjx.studies.sweep.spec import Sweep
from fingers_mjx.training.population import program

WORLDS_PER_GIB = 256
"""Worlds for each GiB of a GPU's memory: an H200 of 139 GiB trains 8 × 4,096 (ours)."""
WORLDS_ON_CPU = 4096
"""Most worlds of a program on the CPU, which gains nothing by more (ours)."""


def population(spec: Sweep, root: Path, command: Sequence[str] = WORKER) -> Engine:
    """Returns the engine that trains members together that can share a program.

    Together are members that differ only in what a population leaves to each
    (`fingers_mjx.training.population`) and have come equally far; as many as
    `worlds_at_once` allows, in equal parts where several programs run at a time, and
    half of that for members that failed: so that memory that was too small for them all
    suffices, and what one does to the program does not befall all of them again.

    Args:
        spec: resolved; without `processes` there is one program at a time, on several
            GPUs one on each.
        root: directory of the sweep, absolute.
        command: of a worker.
    """
    most = most_worlds(spec)
    slots = spec.processes or (default_processes(spec) if spec.backend == "warp" else 1)
    known: dict[Key, str] = {}

    def choose(waiting: Sequence[Key], failures: Failures) -> tuple[Key, ...]:
        first = waiting[0]
        for key in (*keys(spec), *waiting):
            if key not in known:
                known[key] = shared(trainings(spec, root, key))
        alike = [
            key
            for key in waiting
            if (known[key], failures(key), _reached(spec, root, key))
            == (known[first], failures(first), _reached(spec, root, first))
        ]
        share = -(-list(known.values()).count(known[first]) // slots)
        worlds = trainings(spec, root, first)[0].setup.train.num_envs
        return tuple(alike[: max(1, min(most // worlds, share) >> failures(first))])

    return worker_engine(spec, root, command, slots, choose)


def most_worlds(spec: Sweep) -> int:
    """Returns how many worlds one program of a sweep may have."""
    return spec.worlds_at_once or machine_worlds(spec.backend)


def machine_worlds(backend: str | None) -> int:
    """Returns how many worlds one program of this machine has room for.

    Args:
        backend: physics backend.
    """
    if backend != "warp":
        return WORLDS_ON_CPU
    memory_mib = [int(size) for size in gpu_facts("memory.total") if size.isdigit()]
    return int(min(memory_mib) / 1024 * WORLDS_PER_GIB) if memory_mib else WORLDS_ON_CPU


def shared(stages: Sequence[Training]) -> str:
    """Returns what a member shares with the others of its program, as text.

    Args:
        stages: of the member.
    """
    found = [[one.path.name, program(one.setup)] for one in stages]
    return json.dumps(found, sort_keys=True)


def _reached(spec: Sweep, root: Path, key: Key) -> list[int]:
    """Returns the iterations that each stage of a member goes on from, -1 if afresh."""
    runs = [key.directory(root) / stage.name for stage in spec.stages]
    found = [
        [] if begins_again(spec, run) else checkpoint.checkpoints(run / "checkpoints")
        for run in runs
    ]
    return [int(saved[-1].name) if saved else -1 for saved in found]
