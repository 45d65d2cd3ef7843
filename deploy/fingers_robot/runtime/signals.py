"""Signals: what asks for an end goes to the console, which stops the hand first."""

import signal


def ignore_interrupts() -> None:
    """Leaves interrupts and requests to end to the console's process.

    A terminal, and a service manager, send them to every process of a run at once; a
    supervisor that obeyed would leave the hand in the middle of a stride.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
