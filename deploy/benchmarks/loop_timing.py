"""L1 to L4: the real loop in real time against a simulated hand in another process.

    python deploy/benchmarks/loop_timing.py --minutes 10 --load 4 [--no-realtime]

`--load` starts that many busy processes; they end with the measurement.
"""

import argparse
import json
import multiprocessing
import os
import sys
import tempfile
import time
from pathlib import Path

from fault_processes import plain_options
from hand_files import marching_bundle, write_model

from fingers_deploy.bundle import load_bundle
from fingers_deploy.drivers.sim import SimulatorProcess
from fingers_deploy.record import read_log
from fingers_deploy.runtime.launcher import Launcher
from fingers_mjx.bundle import write_bundle


def _busy() -> None:
    """Keeps a core and some memory busy."""
    block = bytearray(2**22)
    while True:
        block[:] = bytes(len(block))


def stolen_s() -> float:
    """Time that a hypervisor took from this machine's processors so far [s]."""
    steal = int(Path("/proc/stat").read_text().split()[8])
    return steal / os.sysconf("SC_CLK_TCK")


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
        memory: list[float] = []
        end, stolen = time.monotonic() + seconds, stolen_s()
        while time.monotonic() < end and launcher.poll(0.2):
            mode = launcher.status.get("mode")
            memory.append(launcher.status.get("memory_mb", 0.0))
            if mode == "disabled":
                launcher.send("arm")
            elif mode == "stopping":
                launcher.send("stop")
            elif mode == "safe":
                launcher.send("clear")
        launcher.send("quit")
        while launcher.poll(0.05):
            pass
        launcher.finish()
        rows = [read_log(file).rows for file in sorted(Path(out).glob("*.mcap"))]
    trips = [line for line in lines if line.startswith("active -> ")]
    active = sum(int((part["mode"] == 2).sum()) for part in rows)
    return {
        "stolen_s": round(stolen_s() - stolen, 2),
        "scheduler": launcher.status["realtime"],
        **launcher.status["timing"],
        "memory_mb": [round(memory[len(memory) // 10], 2), round(memory[-1], 2)],
        "steps_with_policy": active,
        "stops": max(len(trips) - 1, 0),
        "why": sorted({line.split(":")[0] for line in lines if " -> hold" in line}),
    }


def main() -> int:
    """Runs the measurement and prints it as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bundle", type=Path)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--load", type=int, default=0)
    parser.add_argument("--no-realtime", action="store_true")
    options = parser.parse_args()
    load = [
        multiprocessing.Process(target=_busy, daemon=True) for _ in range(options.load)
    ]
    for process in load:
        process.start()
    with tempfile.TemporaryDirectory() as folder:
        model = write_model(Path(folder) / "hand.xml")
        bundle = options.bundle or Path(folder) / "march"
        if not options.bundle:
            write_bundle(bundle, marching_bundle())
        seconds = 60 * options.minutes
        result = measure(bundle, model, seconds, not options.no_realtime)
    for process in load:
        process.kill()
    print(json.dumps({"load": options.load, **result}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
