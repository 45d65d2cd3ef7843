"""Double faults, floods and closed channels, with real processes in real time."""

import fcntl
import os
import signal
import sys
import termios
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from faults.console_run import ConsoleRun, energize
from faults.watched_hand import WatchedHand

from fingers_deploy.bundle import load_bundle
from fingers_robot.runtime.launcher import EXIT_UNKNOWN, UNKNOWN

FLOOD = 20_000
KILL, STOP = signal.SIGKILL, signal.SIGSTOP


@dataclass(frozen=True)
class Off:
    """What one trial showed.

    Attributes:
        off_s: from the fault to the first order to de-energize [s].
        safe: the hand was de-energized at the end, or the operator was warned that
            nobody knows.
    """

    off_s: float
    safe: bool


@dataclass(frozen=True)
class Channel:
    """One fault of processes or channels.

    Attributes:
        name: what happens.
        begin: makes it happen; returns when [s].
        within_s: longest time to the order to de-energize.
        reads: whether anybody reads what the run says.
    """

    name: str
    begin: Callable[[ConsoleRun], float]
    within_s: float
    reads: bool = True


def _killed(*names: str) -> Callable[[ConsoleRun], float]:
    return lambda run: run.signal(KILL, *names)


def _console_stopped(run: ConsoleRun) -> float:
    run.signal(STOP, "console")
    return run.signal(KILL, "supervisor")


def _supervisor_stopped(run: ConsoleRun) -> float:
    run.signal(STOP, "supervisor")
    return run.signal(KILL, "console")


def _input_closed(run: ConsoleRun) -> float:
    assert run.process.stdin is not None
    now = time.monotonic()
    run.process.stdin.close()
    return now


def _unread(run: ConsoleRun) -> float:
    """Has the run say things until the pipe that nobody reads is full; returns when."""
    assert run.process.stdout is not None
    handle, counts = run.process.stdout.fileno(), [0]
    while run.process.poll() is None and len(counts) < 200:
        run.type("status\n")
        time.sleep(0.3)
        waiting = fcntl.ioctl(handle, termios.FIONREAD, bytes(4))
        counts.append(int.from_bytes(waiting, sys.byteorder))
        if counts[-1] == counts[-2] > 0:
            break
    return time.monotonic() - 0.6


def _hangs_up(run: ConsoleRun) -> float:
    now = time.monotonic()
    os.killpg(run.process.pid, signal.SIGHUP)
    return now


_GUARD_S = 3.0
_SETTLED_S = 3.1  # the settling, which takes 1.5 s, at most 3 s, and the reaction
CHANNELS = (
    Channel(
        "S13 console and supervisor killed", _killed("console", "supervisor"), _GUARD_S
    ),
    Channel("S13 console stopped, supervisor killed", _console_stopped, _GUARD_S),
    Channel("S13 supervisor stopped, console killed", _supervisor_stopped, _GUARD_S),
    Channel(
        "S13 guard and supervisor killed", _killed("supervisor", "guard"), _GUARD_S
    ),
    Channel("OP guard killed", _killed("guard"), _SETTLED_S + 0.2),
    Channel("OP guard and console killed", _killed("guard", "console"), _SETTLED_S),
    Channel("OP console stopped", lambda r: r.signal(STOP, "console"), 2 + _SETTLED_S),
    Channel("OP terminal closed", _hangs_up, _SETTLED_S),
    Channel("OP stop behind 20,000 lines", lambda r: flood(r, "stop"), _SETTLED_S),
    Channel("OFF off behind 20,000 lines", lambda r: flood(r, "off"), 0.1),
    Channel("OP standard input closed", _input_closed, _SETTLED_S),
    Channel("OP standard output unread", _unread, 1.5 + _SETTLED_S, reads=False),
)
STOPPED_HAND = "S1 hand stopped for ever"
WARNED_S = 3.0
"""Within this the operator is warned: the hand stops, four orders are not confirmed."""


def flood(run: ConsoleRun, word: str) -> float:
    """Types 20,000 lines and a word; returns when the word's line was written [s]."""
    assert run.process.stdin is not None
    data, handle = b"arm\n" * FLOOD, run.process.stdin.fileno()
    while data:
        data = data[os.write(handle, data[:65536]) :]
    return run.type(f"{word}\n")


def fail_channel(model: Path, bundle: Path, channel: Channel, seed: int) -> Off:
    """Energizes a hand, lets the fault happen at a random time, and watches."""
    interface, rng = load_bundle(bundle).manifest.interface, np.random.default_rng(seed)
    with (
        WatchedHand(model, interface, seed) as hand,
        ConsoleRun(bundle, hand.path, ["--no-record"], channel.reads) as run,
    ):
        if channel.reads:
            energize(run)
        else:
            _energize_unread(run, hand)
        time.sleep(rng.uniform(0.1, 1.0))
        begun_s = channel.begin(run)
        deadline = begun_s + channel.within_s + 3.0
        while hand.energized and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(0.3)
        return Off(hand.off_after(begun_s), not hand.energized)


def stop_hand(model: Path, bundle: Path, seed: int) -> Off:
    """Stops the hand for ever: the operator must learn that nobody knows its state.

    The time is that to the first warning; safe means that the last lines and the exit
    status say so as well.
    """
    interface, rng = load_bundle(bundle).manifest.interface, np.random.default_rng(seed)
    with (
        WatchedHand(model, interface, seed) as hand,
        ConsoleRun(bundle, hand.path, ["--no-record"]) as run,
    ):
        energize(run)
        time.sleep(rng.uniform(0.1, 1.0))
        begun_s = time.monotonic()
        hand.stop_for_ever()
        warned_s = run.wait_for("CUT THE BATTERY", 10.0, begun_s)
        run.type("quit\n")
        status = run.process.wait(timeout=40)
        time.sleep(0.1)
        last = run.said(UNKNOWN) is not None
        return Off(warned_s - begun_s, last and status == EXIT_UNKNOWN)


def _energize_unread(run: ConsoleRun, hand: WatchedHand) -> None:
    deadline = time.monotonic() + 60.0
    while not hand.energized:
        if time.monotonic() > deadline:
            raise TimeoutError("not armed")
        run.type("arm\n")
        time.sleep(0.4)
