"""From a stop that is typed to the order on the wire, under what may hold it up.

    python deploy/benchmarks/stop_timing.py --trials 1000

types `off` while 20,000 lines stand before it, the disk is full, the policy's process
is stopped or the machine is loaded, and finds when the simulated hand was ordered to
de-energize; and `stop`, which settles the hand first: when the operator reads that it
began. Everything is the real command and real processes, in real time.
"""

import argparse
import json
import multiprocessing
import os
import signal
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from faults.channels import flood
from faults.console_run import ConsoleRun
from faults.watched_hand import WatchedHand
from hand_files import WALKING, write_model
from loop_timing import _busy

from fingers_deploy.bundle import load_bundle

CONDITIONS = ("plain", "flood", "full disk", "policy stopped", "loaded machine")
WITHIN_S = 0.100
_SMALL = 200_000  # bytes that a run may write where the disk is full
_PER_RUN = 50
_ARM_S = 10.0


class NotArmed(RuntimeError):
    """The hand cannot be armed, which says nothing about stops."""


def rearm(run: ConsoleRun, hand: WatchedHand, rng: np.random.Generator) -> None:
    """Brings the hand from off to energized, and waits a random time.

    A hand that was switched off in the middle of its ramp may have fallen over.

    Raises:
        NotArmed: it cannot be armed.
    """
    deadline = time.monotonic() + _ARM_S
    while not hand.energized:
        if time.monotonic() > deadline:
            raise NotArmed(f"{run.lines[-5:]}")
        run.type("clear\n")
        time.sleep(0.03)
        t = run.type("arm\n")
        while not hand.energized and time.monotonic() - t < 0.35:
            time.sleep(0.005)
        if hand.energized:
            time.sleep(rng.uniform(0.05, 0.4))  # meanwhile a fault may have stopped it


def measure(
    hand: WatchedHand,
    run: ConsoleRun,
    word: str,
    condition: str,
    rng: np.random.Generator,
) -> float:
    """Types a word under a condition; returns the time to what it must cause [s]."""
    rearm(run, hand, rng)
    paused = condition == "policy stopped"
    if paused:
        run.signal(signal.SIGSTOP, "policy")
    typed_s = flood(run, word) if condition == "flood" else run.type(f"{word}\n")
    try:
        if word == "off":
            return _until_off(hand, typed_s)
        began_s = run.wait_for("OP operator stop", 10.0, typed_s)
        off_s = _until_off(hand, typed_s)
        return began_s - typed_s if off_s < np.inf else np.inf
    except TimeoutError:
        return np.inf
    finally:
        if paused:
            run.signal(signal.SIGCONT, "policy")


def _until_off(hand: WatchedHand, typed_s: float) -> float:
    deadline = time.monotonic() + 10.0
    while time.monotonic() < deadline:
        if (off_s := hand.off_after(typed_s)) < np.inf:
            return off_s
        time.sleep(0.005)
    return np.inf


def _some(hand, run, word, condition, rng, took: list[float], trials: int) -> None:
    """Adds trials of one run, until the hand has fallen and cannot be armed."""
    for number in range(min(_PER_RUN, trials - len(took))):
        try:
            took.append(measure(hand, run, word, condition, rng))
        except NotArmed:
            if number == 0:
                raise
            return


def measure_condition(
    model: Path, bundle: Path, word: str, condition: str, trials: int, seed: int
) -> dict:
    """Measures one word under one condition, in runs of 50 trials each."""
    interface, took = load_bundle(bundle).manifest.interface, []
    rng = np.random.default_rng(seed)
    load = os.cpu_count() if condition == "loaded machine" else 0
    hogs = [
        multiprocessing.Process(target=_busy, daemon=True) for _ in range(load or 0)
    ]
    for process in hogs:
        process.start()
    try:
        while len(took) < trials:
            with tempfile.TemporaryDirectory() as out:
                full = condition == "full disk"
                more = ["--out", out] if full else ["--no-record"]
                size = _SMALL if full else None
                with (
                    WatchedHand(model, interface, seed) as hand,
                    ConsoleRun(bundle, hand.path, more, files_bytes=size) as run,
                ):
                    if full:
                        run.wait_for("NOT RECORDING", 60.0)
                    _some(hand, run, word, condition, rng, took, trials)
    finally:
        for process in hogs:
            process.kill()
    ms = 1e3 * np.array(took)
    return {
        "typed": word,
        "condition": condition,
        "trials": len(took),
        "within_100_ms": int((ms <= 1e3 * WITHIN_S).sum()),
        "median_ms": round(float(np.median(ms)), 1),
        "p99_ms": round(float(np.quantile(ms, 0.99)), 1),
        "worst_ms": round(float(ms.max()), 1),
        "load_average": round(os.getloadavg()[0], 1),
    }


def main() -> int:
    """Runs the measurement, one row a line; returns 0 if all were in time."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bundle", type=Path, default=WALKING)
    parser.add_argument("--trials", type=int, default=1000, help="of off, in all")
    parser.add_argument("--stops", type=int, default=100, help="of stop, in all")
    parser.add_argument("--conditions", nargs="+", choices=CONDITIONS)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    conditions = options.conditions or CONDITIONS
    late = 0
    with tempfile.TemporaryDirectory() as folder:
        model = write_model(Path(folder) / "hand.xml")
        for word, trials in (("off", options.trials), ("stop", options.stops)):
            for condition in conditions:
                count = -(-trials // len(conditions))
                row = measure_condition(
                    model, options.bundle, word, condition, count, options.seed
                )
                late += row["trials"] - row["within_100_ms"]
                print(json.dumps(row), flush=True)
    return int(late > 0)


if __name__ == "__main__":
    sys.exit(main())
