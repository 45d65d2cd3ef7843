"""A simulated hand in a process of its own that writes down when power was asked for.

    python watched_hand.py LOG MODEL ARGUMENTS…

takes the arguments of `fingers_robot.simulator.server`.
"""

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from fingers_deploy.manifest import Interface
from fingers_robot.drivers.sim import server_arguments
from fingers_robot.drivers.sim_packets import Ask
from fingers_robot.simulator import server

_START_S = 60.0


class WatchedServer(server.Server):
    """Serves a hand, and writes each order that changes its power to a log."""

    log = Path(os.devnull)

    def _take(self, packet: np.void) -> None:
        ask, was = Ask(int(packet["ask"])), self._hand.enabled
        super()._take(packet)
        if ask == Ask.DISABLE or self._hand.enabled != was:
            with self.log.open("a", encoding="ascii") as file:
                file.write(f"{time.monotonic():.6f} {ask.name}\n")


class WatchedHand:
    """Starts and ends such a hand.

    Args:
        model: MJCF file.
        interface: of the policy.
        seed: of the sensor noise.
    """

    def __init__(self, model: Path, interface: Interface, seed: int = 0):
        self._folder = tempfile.TemporaryDirectory(prefix="watched-hand-")
        folder = Path(self._folder.name)
        self.path, self._log = str(folder / "hand"), folder / "power"
        self._log.touch()
        arguments = server_arguments(self.path, interface, seed)
        program = [sys.executable, __file__, str(self._log), str(model), *arguments]
        self.process = subprocess.Popen(program, cwd=folder)
        deadline = time.monotonic() + _START_S
        while not os.path.exists(self.path):
            if self.process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError("the watched hand did not start")
            time.sleep(0.01)

    def orders(self) -> list[tuple[float, str]]:
        """Time [s] and name of each order for power so far."""
        lines = [line.split() for line in self._log.read_text("ascii").splitlines()]
        return [(float(t), name) for t, name in lines]

    @property
    def energized(self) -> bool:
        """Whether the last order for power was to energize."""
        orders = self.orders()
        return bool(orders) and orders[-1][1] == "ENABLE"

    def off_after(self, t_s: float) -> float:
        """From a time to the first order to de-energize after it [s]; else infinite."""
        later = [t - t_s for t, name in self.orders() if name == "DISABLE" and t > t_s]
        return later[0] if later else np.inf

    def stop_for_ever(self) -> None:
        """Stops the hand's process: it answers nothing any more."""
        self.process.send_signal(signal.SIGSTOP)

    def close(self) -> None:
        """Ends the hand."""
        self.process.kill()
        self.process.wait()
        with contextlib.suppress(OSError):
            self._folder.cleanup()

    def __enter__(self) -> "WatchedHand":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def main() -> int:
    """Runs the hand's process."""
    WatchedServer.log = Path(sys.argv[1])
    server.Server = WatchedServer
    return server.main(sys.argv[2:])


if __name__ == "__main__":
    sys.exit(main())
