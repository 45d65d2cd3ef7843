"""S11 to S13 with real processes: what happens when one of them dies or hangs."""

import signal
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fingers_deploy.bundle import load_bundle
from fingers_robot.drivers.sim import SimulatorProcess
from fingers_robot.record import read_log
from fingers_robot.runtime.launcher import Launcher

SIGNALS = {
    "S11 policy stopped (SIGSTOP)": ("policy", signal.SIGSTOP),
    "S12 policy killed (SIGKILL)": ("policy", signal.SIGKILL),
    "S13 supervisor killed (SIGKILL)": ("supervisor", signal.SIGKILL),
    "S13 supervisor stopped (SIGSTOP)": ("supervisor", signal.SIGSTOP),
}
NEXT = {"disabled": "arm", "stopping": "stop", "safe": "clear"}
"""What the operator does in each mode for the policy to run."""
WITHIN_S = {"S11": 0.100, "S12": 0.100, "S13": 3.0}


@dataclass(frozen=True)
class Death:
    """What one trial showed.

    Attributes:
        reaction_s: signal to HOLD, or for the supervisor to confirmed power off [s].
        safe: the hand ended de-energized, as it confirmed itself.
    """

    reaction_s: float
    safe: bool


def plain_options(bundle: Path, socket: str, out: str, **changes) -> dict:
    """Options of a run against a simulator that is there already."""
    return {
        "bundles": [str(bundle)],
        "driver": {"kind": "sim", "socket": socket},
        "loop_hz": 500.0,
        "record": out,
        "wiggle": [],
        "runtime": "auto",
        "sticks": [0.5, 0.0, 0.0],
        "realtime": True,
        **changes,
    }


def kill_one(model: Path, bundle: Path, name: str, seed: int) -> Death:
    """Starts everything, signals one process at a random time, and watches."""
    who, number = SIGNALS[name]
    interface = load_bundle(bundle).manifest.interface
    lines: list[tuple[float, str]] = []
    rng = np.random.default_rng(seed)
    with (
        SimulatorProcess(model, interface, seed=seed, lifetime_s=600.0) as simulator,
        tempfile.TemporaryDirectory() as out,
    ):
        launcher = Launcher(
            plain_options(bundle, simulator.path, out),
            lambda line: lines.append((time.time(), line)),
        )
        _arm(launcher)
        _watch(launcher, rng.uniform(0.3, 1.0))
        signalled = time.time()
        getattr(launcher, who).send_signal(number)
        if who == "policy":
            _watch(launcher, 2.5)
            launcher.send("quit")
            _watch(launcher, 5.0)
        else:
            _watch(launcher, 5.0)
        launcher.finish()
        if who == "policy":
            return _from_log(Path(out), signalled)
        done = [t for t, line in lines if line == "guard: de-energized, confirmed"]
        return Death(done[0] - signalled if done else np.inf, bool(done))


def _arm(launcher: Launcher) -> None:
    """Waits until the policy runs; what stops it on a busy machine is cleared."""
    while launcher.status.get("mode") != "active":
        if not launcher.poll(0.3):
            raise RuntimeError(f"the supervisor ended: {launcher.status}")
        word = NEXT.get(launcher.status.get("mode", ""))
        if word:
            launcher.send(word)


def _watch(launcher: Launcher, seconds: float) -> None:
    """Serves the console for some time, or until the supervisor has ended."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline and launcher.poll(0.02):
        pass


def _from_log(out: Path, signalled: float) -> Death:
    log = read_log(next(out.glob("*.mcap")))
    start = float(log.metadata["start_unix_s"])
    at = {line: start + t for t, line in log.events}
    stopped = [t for line, t in at.items() if line == "active -> stopping"]
    safe = any(line.startswith("de-energized") for line in at)
    return Death(stopped[0] - signalled if stopped else np.inf, safe)
