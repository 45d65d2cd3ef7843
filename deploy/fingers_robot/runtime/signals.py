"""Signals: what asks for an end goes to the console, which stops the hand first."""

import signal
from collections.abc import Callable

ENDS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
"""Requests to end; a terminal that is closed sends SIGHUP to every process of a run."""
PAUSES = (signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU)
"""Requests of a terminal to pause: nobody may pause what holds a hand."""


def ignore_interrupts() -> None:
    """Leaves requests to end or to pause to the console's process.

    A terminal, and a service manager, send them to every process of a run at once; a
    supervisor that obeyed would leave the hand in the middle of a stride.
    """
    for number in (*ENDS, *PAUSES):
        signal.signal(number, signal.SIG_IGN)


def on_request_to_end(act: Callable[[], None]) -> None:
    """Acts on every request to end, and ignores those to pause."""
    for number in ENDS:
        signal.signal(number, lambda *_: act())
    for number in PAUSES:
        signal.signal(number, signal.SIG_IGN)
