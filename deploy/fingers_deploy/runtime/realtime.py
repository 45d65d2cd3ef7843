"""What a process can do to be on time; what was not allowed is reported."""

import gc
import os

PRIORITY = 50


def prefer_this_process(priority: int = PRIORITY, ask: bool = True) -> str:
    """Asks for SCHED_FIFO and takes garbage collection out of the loop.

    To be called once everything that lives on has been made: what exists is frozen, and
    nothing is collected from then on. The loop makes no reference cycles, so that
    memory stays flat without a collector.

    Args:
        priority: real-time priority, 1 to 99.
        ask: ask for it at all.

    Returns:
        What was obtained, in words, for status and log.
    """
    gc.collect()
    gc.freeze()
    gc.disable()
    if not ask:
        return "no real-time priority (not asked for)"
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (OSError, AttributeError) as error:
        reason = getattr(error, "strerror", None) or "not on this system"
        return f"no real-time priority ({reason})"
    return f"SCHED_FIFO {priority}"
