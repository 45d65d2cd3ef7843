"""Driver of the simulated hand, which runs in another process."""

import os
import re
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from fingers_deploy.errors import InputError
from fingers_deploy.manifest import Interface
from fingers_robot.drivers.one_file import read_model
from fingers_robot.drivers.sim_packets import STATE, Ask, request
from fingers_robot.drivers.stand_in import info_of, sound_health
from fingers_robot.reading import Array, Health, ImuReading, Reading
from fingers_robot.waiting import waiting

_START_S, _ANSWER_S = 30.0, 2.0


class SimDriver:
    """A hand in MuJoCo, over a local socket.

    Args:
        path: path of the simulator's socket.
        interface: of the policy: joint names and limits.

    Raises:
        OSError: there is no simulator at this path, or none that takes drivers.
    """

    def __init__(self, path: str | Path, interface: Interface):
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket.settimeout(_ANSWER_S)
        try:
            self._socket.connect(str(path))
        except OSError:
            self._socket.close()
            raise
        self._socket.setblocking(False)
        self.over = False
        self._state: np.void | None = None
        self.info = info_of(interface, f"simulated hand at {path}")

    @property
    def state(self) -> np.void | None:
        """The newest packet, with the true pose of the palm, for measurements."""
        return self._state

    def read(self) -> Reading | None:
        """As the protocol says."""
        self._drain()
        s = self._state
        return None if s is None else Reading(float(s["t_s"]), s["pos"], s["effort"])

    def imu(self) -> ImuReading | None:
        """As the protocol says."""
        s = self._state
        return None if s is None else ImuReading(float(s["t_s"]), s["quat"], s["gyro"])

    def health(self) -> Health | None:
        """As the protocol says."""
        s = self._state
        if s is None:
            return None
        return sound_health(float(s["health_t_s"]), bool(s["enabled"]), s["pos"])

    def write(self, target_rad: Array) -> None:
        """As the protocol says."""
        self._socket.send(request(Ask.TARGET, target=target_rad))

    def enable(self) -> None:
        """As the protocol says."""
        self._socket.send(request(Ask.ENABLE))

    def disable(self) -> None:
        """As the protocol says."""
        self._socket.send(request(Ask.DISABLE))

    def close(self) -> None:
        """As the protocol says."""
        try:
            self.disable()
        except OSError:
            pass  # the simulator or the socket is gone already
        finally:
            self._socket.close()

    def _drain(self) -> None:
        """Takes the newest packet; older ones are of no use."""
        for data in waiting(self._socket.recv, STATE.itemsize):
            if len(data) != STATE.itemsize:
                raise ConnectionError("the simulator has gone")
            self._state = np.frombuffer(data, STATE)[0]


def where_the_palm_is(path: str | Path, interface: Interface) -> tuple[float, float]:
    """Asks a simulator in real time for the place of the palm on the floor [m].

    Raises:
        OSError: there is no simulator at this path, or none that answers.
    """
    driver = SimDriver(path, interface)
    try:
        deadline = time.monotonic() + _ANSWER_S
        while driver.read() is None or driver.state is None:
            if time.monotonic() > deadline:
                raise TimeoutError("the simulator does not answer")
            time.sleep(0.005)
        x, y, _ = driver.state["base_pos"].tolist()
        return x, y
    finally:
        driver.close()


def server_arguments(path: str, interface: Interface, seed: int) -> list[str]:
    """Arguments of a simulator's process that ends with this one.

    Args:
        path: of its socket.
        interface: of the policy, for joints and command path.
        seed: of the sensor noise.
    """
    chain = interface.command_path
    return [
        f"--socket={path}",
        f"--joints={','.join(interface.joint_names)}",
        f"--delay-s={chain.delay_s}",
        f"--lowpass-hz={chain.lowpass_hz or 1e6}",
        f"--slew-rad-s={','.join(map(repr, interface.slews_rad_s))}",
        f"--seed={seed}",
        f"--parent={os.getpid()}",
    ]


def _refusal(line: str) -> InputError:
    """The error that the simulator's process has said, or that it ended without one."""
    said = re.fullmatch(r"(.+?): found (.+); valid: (.+)", line)
    if said is not None:
        return InputError(said[1], "", said[2], said[3])
    valid = "a model that it can run, and mujoco (the extra [sim])"
    return InputError("simulator", "", line, valid)


class SimulatorProcess:
    """Starts and ends the simulator's process.

    Args:
        model: MJCF or MJB file.
        interface: of the policy: joint names and command path.
        seed: seed of the sensor noise.
        lifetime_s: real time after which the simulator ends by itself [s].

    Raises:
        InputError: the simulator refuses the model or cannot start.
    """

    def __init__(
        self,
        model: str | Path,
        interface: Interface,
        seed: int = 0,
        lifetime_s: float = 86400.0,
    ):
        read_model(Path(model))  # refused here, before any process starts
        self._folder = tempfile.TemporaryDirectory(prefix="fingers-sim-")
        self.path = str(Path(self._folder.name) / "hand")
        arguments = server_arguments(self.path, interface, seed)
        arguments.append(f"--lifetime-s={lifetime_s}")
        program = [sys.executable, "-m", "fingers_robot.simulator.server"]
        self.process = subprocess.Popen(
            [*program, str(Path(model).absolute()), *arguments],
            cwd=self._folder.name,  # where MuJoCo writes its log
            stderr=subprocess.PIPE,
            text=True,
        )
        self._wait()

    def close(self) -> None:
        """Ends the process."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()
        self._folder.cleanup()

    def __enter__(self) -> "SimulatorProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _wait(self) -> None:
        deadline = time.monotonic() + _START_S
        while not os.path.exists(self.path):
            if self.process.poll() is not None or time.monotonic() > deadline:
                self.process.kill()
                _, message = self.process.communicate()
                self._folder.cleanup()
                raise _refusal((message.strip().splitlines() or ["no answer"])[-1])
            time.sleep(0.01)
