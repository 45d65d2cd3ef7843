"""The simulator's process: a simulated hand behind a local socket.

The hand lives in real time by itself, as a real one: it follows the newest targets it
was given, and when its driver goes away it holds them and waits for the next driver.
"""

import argparse
import os
import socket
import sys
import time
from collections.abc import Sequence

import numpy as np

from fingers_deploy.errors import InputError
from fingers_robot.drivers.sim_packets import REQUEST, Ask
from fingers_robot.runtime.realtime import PRIORITY, prefer_this_process
from fingers_robot.runtime.signals import ignore_interrupts
from fingers_robot.simulator.hand import SimulatedHand
from fingers_robot.waiting import waiting

STATE_S = 0.002
_WAIT_S = 0.05


class Server:
    """Serves one driver at a time.

    Args:
        hand: the hand.
        listener: a bound local socket.
    """

    def __init__(self, hand: SimulatedHand, listener: socket.socket):
        self._hand = hand
        self._listener = listener
        self._client: socket.socket | None = None

    def run(self, lifetime_s: float, parent: int = 0) -> None:
        """Lives for some time, one driver after the other.

        Args:
            lifetime_s: how long [s].
            parent: process whose child this is; it ends with it. 0: it stays.
        """
        self._listener.setblocking(False)
        begin = time.monotonic()
        offset = begin - float(self._hand.data.time)
        deadline = begin
        while deadline - begin < lifetime_s and parent in (0, os.getppid()):
            self._serve_one_state(offset)
            deadline += STATE_S
            late = time.monotonic() - deadline
            if late < 0:
                time.sleep(-late)
            elif late > _WAIT_S:
                # The machine was away; a real hand's time would have passed as well.
                deadline += late

    def _serve_one_state(self, offset: float) -> None:
        if self._client is None:
            self._accept()
        if self._client is not None:
            for data in waiting(self._client.recv, REQUEST.itemsize):
                if len(data) != REQUEST.itemsize:
                    self._drop()
                    break
                self._take(np.frombuffer(data, REQUEST)[0])
        self._hand.advance(time.monotonic() - offset)
        if self._client is not None:
            self._send(self._hand.state(offset).tobytes())

    def _take(self, packet: np.void) -> None:
        """Does what is asked."""
        ask, target = int(packet["ask"]), packet["target"]
        if ask == Ask.TARGET and np.isfinite(target).all():
            self._hand.target_rad = target.copy()
        enable = ask == Ask.ENABLE
        if ask in (Ask.ENABLE, Ask.DISABLE) and self._hand.enabled != enable:
            self._hand.set_enabled(enable)

    def _accept(self) -> None:
        try:
            self._client, _ = self._listener.accept()
            self._client.setblocking(False)
        except BlockingIOError:
            return

    def _send(self, data: bytes) -> None:
        try:
            assert self._client is not None
            self._client.send(data)
        except BlockingIOError:
            return  # the driver does not keep up; it will get a newer one
        except OSError:
            self._drop()

    def _drop(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None


def _numbers(text: str) -> list[float]:
    return [float(word) for word in text.split(",")]


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the simulator; returns the exit status."""
    parser = argparse.ArgumentParser(prog="fingers-deploy-sim", description=__doc__)
    parser.add_argument("model", help="MJCF or MJB file")
    parser.add_argument("--socket", required=True, help="path of the local socket")
    parser.add_argument("--joints", required=True, help="joint names, by commas")
    parser.add_argument("--delay-s", type=float, default=0.02)
    parser.add_argument("--lowpass-hz", type=float, default=3.0)
    parser.add_argument("--slew-rad-s", default="2.8", help="one, or each, by commas")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--lifetime-s", type=float, default=86400.0)
    parser.add_argument("--parent", type=int, default=0)
    options = parser.parse_args(arguments)
    if options.parent:
        ignore_interrupts()  # whoever started this also ends it, after the hand stood
    try:
        hand = SimulatedHand(
            options.model,
            tuple(options.joints.split(",")),
            options.delay_s,
            options.lowpass_hz,
            _numbers(options.slew_rad_s),
            options.seed,
        )
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listener:
        # Under its name only once it listens: whoever waits for the name connects.
        listener.bind(f"{options.socket}.new")
        listener.listen(1)
        os.rename(f"{options.socket}.new", options.socket)
        # A real hand does not wait for this computer either.
        prefer_this_process(PRIORITY + 10)
        Server(hand, listener).run(options.lifetime_s, options.parent)
    return 0


if __name__ == "__main__":
    sys.exit(main())
