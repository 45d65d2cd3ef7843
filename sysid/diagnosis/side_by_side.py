"""Work that fills the cores of the process: joints, and batches of candidates.

The steps of a batch are too small for more than one core.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")


def side_by_side(calls: Sequence[Callable[[], T]]) -> list[T]:
    """Returns what calls return, made beside each other on the cores of the process.

    Args:
        calls: of compiled programs, which leave Python to others.
    """
    if len(calls) == 1:
        return [calls[0]()]
    with ThreadPoolExecutor(_cores()) as threads:
        return list(threads.map(lambda call: call(), calls))


def _cores() -> int:
    """Number of cores on which the process may run."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
