"""A witness of pauses that no program can help: one process per core that only sleeps.

A virtual machine is put aside by its host, for 100 ms at a time where the host meters
it. A process of the highest priority that does nothing but sleep is then late as well;
what is late without it being late is the fault of the program that is measured.
"""

import multiprocessing
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection

PERIOD_S, PAUSE_S = 0.002, 0.004
PRIORITY = 90

Pause = tuple[float, float]
"""Begin and end of a pause, in time since the epoch [s]."""


class Pauses:
    """What the witnesses saw; complete after their `with` block."""

    def __init__(self) -> None:
        self.found: list[Pause] = []

    def during(self, begin: float, end: float) -> bool:
        """Whether a pause overlaps these times [s since the epoch]."""
        return any(a <= end and b >= begin for a, b in self.found)

    @property
    def total_s(self) -> float:
        """Sum of the pauses of all cores [s]."""
        return sum(b - a for a, b in self.found)


@contextmanager
def witnesses() -> Iterator[Pauses]:
    """Watches every core while the block runs; needs real-time priority."""
    pauses, running = Pauses(), []
    for core in os.sched_getaffinity(0):
        ours, theirs = multiprocessing.Pipe()
        process = multiprocessing.Process(
            target=_watch, args=(core, theirs), daemon=True
        )
        process.start()
        running.append((process, ours))
    try:
        yield pauses
    finally:
        for process, end in running:
            end.send("end")
            pauses.found += end.recv()
            process.join()


def _watch(core: int, end: Connection) -> None:
    os.sched_setaffinity(0, {core})
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    found: list[Pause] = []
    before = time.time()
    while not end.poll():
        time.sleep(PERIOD_S)
        now = time.time()
        if now - before > PAUSE_S:
            found.append((before, now))
        before = now
    end.send(found)
