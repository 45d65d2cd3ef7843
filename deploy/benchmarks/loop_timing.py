"""L1 to L5: the real loop in real time against a simulated hand in another process.

    python deploy/benchmarks/loop_timing.py --minutes 10 --load 2 [--no-realtime]

`--load` starts that many busy processes; they end with the measurement. The policy is
the committed one; the hand walks all the time, and is armed again after a stop.
"""

import argparse
import json
import multiprocessing
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from faults.processes import NEXT, plain_options
from hand_files import WALKING, write_model

from fingers_deploy.bundle import load_bundle
from fingers_robot.drivers.sim import SimulatorProcess
from fingers_robot.record import read_log
from fingers_robot.runtime.launcher import Launcher
from fingers_robot.runtime.realtime import resident_mb
from fingers_robot.safety import Mode

SAMPLE_S = 10.0


def _busy() -> None:
    """Keeps a core and some memory busy."""
    block = bytearray(2**22)
    while True:
        block[:] = bytes(len(block))


def busy_s() -> float:
    """Busy time of all processors so far [s]."""
    words = Path("/proc/stat").read_text().split()[1:8]
    user, nice, system, _, _, irq, soft = map(int, words)
    return (user + nice + system + irq + soft) / os.sysconf("SC_CLK_TCK")


class Memory:
    """Resident memory of both processes over time."""

    def __init__(self, launcher: Launcher):
        self._processes = launcher.supervisor, launcher.policy
        self._next_s, self.samples = 0.0, []

    def sample(self) -> None:
        """Takes a sample from time to time."""
        t = time.monotonic()
        if t >= self._next_s:
            self._next_s = t + SAMPLE_S
            each = [resident_mb(process.pid) for process in self._processes]
            self.samples.append((t, *each))

    def summary(self) -> dict:
        """Largest size, and growth per hour by a straight line; the start left out."""
        table = np.array(self.samples[len(self.samples) // 10 :])
        hours = (table[:, 0] - table[0, 0]) / 3600
        fits = [np.polyfit(hours, table[:, k], 1)[0] for k in (1, 2)]
        return {
            "memory_mb": [round(x, 1) for x in table[:, 1:].max(axis=0).tolist()],
            "growth_mb_per_h": [round(float(x), 2) for x in fits],
        }


def operate(launcher: Launcher, seconds: float, each: Callable[[], None]) -> None:
    """Arms, and arms again after every stop; at the end quits."""
    end = time.monotonic() + seconds
    while time.monotonic() < end and launcher.poll(0.2):
        each()
        word = NEXT.get(launcher.status.get("mode", ""))
        if word:
            launcher.send(word)
    launcher.send("quit")
    while launcher.poll(0.05):
        pass
    launcher.finish()


def measure(bundle: Path, model: Path, seconds: float, realtime: bool) -> dict:
    """Runs for some time; returns the timing that the run itself recorded."""
    interface = load_bundle(bundle).manifest.interface
    lines: list[str] = []
    with (
        SimulatorProcess(model, interface, lifetime_s=seconds + 120) as simulator,
        tempfile.TemporaryDirectory() as out,
    ):
        options = plain_options(bundle, simulator.path, out, realtime=realtime)
        launcher = Launcher(options, lines.append)
        memory = Memory(launcher)
        begin, before = time.monotonic(), busy_s()
        operate(launcher, seconds, memory.sample)
        took, after = time.monotonic() - begin, busy_s()
        if took < seconds:
            raise SystemExit("\n".join(["the run ended early", *lines[-9:]]))
        files = sorted(Path(out).glob("*.mcap"))
        largest = max(file.stat().st_size for file in files)
        recorded = [_recorded(file) for file in files]
    status, timing = launcher.status, launcher.status["timing"]
    missed = timing["late_over_5ms"] + timing["skipped"]
    asked = timing["control_steps"] + timing["skipped"]
    return {
        "minutes": round(took / 60, 1),
        "busy_cores": round((after - before) / took, 2),
        "scheduler": status["realtime"],
        "missed_percent": round(100 * missed / asked, 4),
        "missed": missed,
        "late_percent_of_gaps": round(
            100 * timing["gaps_over_4ms"] / timing["loop_steps"], 4
        ),
        **timing,
        **memory.summary(),
        "files": len(files),
        "largest_file_mb": round(largest / 1e6, 1),
        "steps_with_policy": sum(row["walked"] for row in recorded),
        "worst_skipped_in_a_row": max(row["in_a_row"] for row in recorded),
        "stops": sum(row["stops"] for row in recorded),
        "why": sorted({line.split(":")[0] for line in lines if " -> hold" in line}),
        "warned": any(line.startswith("NOT ON TIME") for line in lines),
    }


def _recorded(file: Path) -> dict[str, int]:
    """Counts of one file: steps with the policy, misses, the supervisor's stops."""
    log = read_log(file)
    rows = log.rows
    total = rows["skipped"].astype(np.int64)
    skipped = np.diff(total, prepend=total[:1])
    asked = {t for t, line in log.events if line.startswith("OP ")}
    ends = [t for t, line in log.events if line.startswith("active -> ")]
    return {
        "walked": int((rows["mode"] == Mode.ACTIVE).sum()),
        "in_a_row": int(skipped.max()) if len(skipped) else 0,
        "stops": sum(t not in asked for t in ends),
    }


def main() -> int:
    """Runs the measurement and prints it as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bundle", type=Path, default=WALKING)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--load", type=int, default=0)
    parser.add_argument("--no-realtime", action="store_true")
    options = parser.parse_args()
    load = [
        multiprocessing.Process(target=_busy, daemon=True) for _ in range(options.load)
    ]
    for process in load:
        process.start()
    try:
        with tempfile.TemporaryDirectory() as folder:
            model = write_model(Path(folder) / "hand.xml")
            seconds = 60 * options.minutes
            result = measure(options.bundle, model, seconds, not options.no_realtime)
    finally:
        for process in load:
            process.kill()
    print(json.dumps({"load": options.load, **result}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
