"""What a process can do to be on time; what was not allowed is reported."""

import gc
import mmap
import os
import sys
import threading

PRIORITY = 50
SWITCH_S = 5e-4  # longest time for which a thread keeps the interpreter


def resident_mb(process: int | str = "self") -> float:
    """Memory of a process that is in RAM [MB]; zero where Linux does not report it."""
    try:
        with open(f"/proc/{process}/statm", encoding="ascii") as file:
            pages = int(file.read().split()[1])
    except OSError:
        return 0.0
    return pages * mmap.PAGESIZE / 1e6


def prefer_this_process(priority: int = PRIORITY, ask: bool = True) -> str:
    """Asks for SCHED_FIFO and takes garbage collection out of the loop.

    The other threads of the process get it as well, a little less urgent: a thread that
    is put aside by other programs while it holds the interpreter's lock would stop the
    loop for as long.

    To be called once everything that lives on has been made: what exists is frozen, and
    nothing is collected from then on. The loop makes no reference cycles, so that
    memory stays flat without a collector.

    Args:
        priority: real-time priority, 1 to 99.
        ask: ask for it at all.

    Returns:
        What was obtained, in words, for status and log.
    """
    sys.setswitchinterval(SWITCH_S)
    gc.collect()
    gc.freeze()
    gc.disable()
    if not ask:
        return "no real-time priority (not asked for)"
    try:
        for thread in threading.enumerate():
            own = thread is threading.current_thread()
            urgency = os.sched_param(priority if own else priority - 1)
            os.sched_setscheduler(thread.native_id or 0, os.SCHED_FIFO, urgency)
    except (OSError, AttributeError) as error:
        reason = getattr(error, "strerror", None) or "not on this system"
        return f"no real-time priority ({reason})"
    return f"SCHED_FIFO {priority}"
