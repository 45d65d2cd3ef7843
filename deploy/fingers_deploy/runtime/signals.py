"""Signals: the operator's interrupt goes to the console, which stops the hand first."""

import signal


def ignore_interrupts() -> None:
    """Leaves interrupts from the keyboard to the console's process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
