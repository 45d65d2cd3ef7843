"""The fault matrix: every row of the safety table, many times.

    python deploy/benchmarks/fault_matrix.py --trials 100 --hours 1

prints one table for each part, for the committed policy; `--parts links` measures only
these. `docs/reference/safety-table.md` keeps what was measured.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from faults.channels import (
    CHANNELS,
    STOPPED_HAND,
    WARNED_S,
    fail_channel,
    stop_hand,
)
from faults.lab import Lab, snapshots
from faults.links import LOSSES, burst, measure_loss
from faults.processes import SIGNALS, WITHIN_S, kill_one
from faults.scenarios import SCENARIOS, Scenario
from faults.startup import STARTS, start_up, stopped_rightly
from faults.trials import passes, run_trial
from hand_files import WALKING, write_model

from fingers_deploy.bundle import Bundle, load_bundle
from fingers_robot.safety import Mode

PARTS = (
    "matrix",
    "starts",
    "losses",
    "bursts",
    "processes",
    "channels",
    "fault_free",
)
PHASES, SPACING_S = 20, 0.13
BURSTS_MS = (30, 60, 500)
ALLOWED_TRIPS = {0.5: 1}  # 20 lost packets in a row: once in a million
LINK_HZ = 500.0  # packets per second on the way from the hand


def measure_scenario(
    starts: list[Lab], scenario: Scenario, trials: int, seed: int
) -> dict:
    """Runs one scenario; returns its row of the results."""
    first = starts[0]
    step = first.core.limits.step_rad
    done = [
        run_trial(starts[k % len(starts)], scenario, seed + k) for k in range(trials)
    ]
    good = [passes(trial, scenario, step, first.period_s) for trial in done]
    reactions = [trial.reaction_s for trial in done]
    return {
        "row": scenario.row,
        "fault": scenario.name,
        "trials": trials,
        "passed": sum(good),
        "within_ms": round(1e3 * scenario.within_s),
        "median_ms": round(1e3 * float(np.median(reactions)), 1),
        "worst_ms": round(1e3 * float(np.max(reactions)), 1),
        "ends": scenario.ends.name.lower(),
        "jump_rad": round(max(trial.jump_rad for trial in done), 4),
        "after_disable": max(trial.after_disable for trial in done),
        "crashes": sum(bool(trial.error) for trial in done),
    }


def measure_start(
    model: Path, bundle: Bundle, name: str, trials: int, hz: float
) -> dict:
    """Runs one faulty start many times; returns its row of the results."""
    done = [start_up(model, bundle, name, k, hz) for k in range(trials)]
    return {
        "start": name,
        "trials": trials,
        "passed": sum(stopped_rightly(start, name) for start in done),
        "step_rad": round(max(s.step_rad for s in done), 4),
    }


def fault_free(start: Lab, hours: float) -> dict:
    """Walks without a fault; every stop is a false one."""
    begin, seconds = start.clock.t, 3600 * hours
    while start.clock.t - begin < seconds and start.mode == Mode.ACTIVE:
        start.run(10.0)
    stopped = start.mode != Mode.ACTIVE
    walked = (start.clock.t - begin) / 3600
    return {"hours": round(walked, 3), "passed": int(not stopped), "trials": 1}


def measure_burst(start: Lab, burst_ms: int) -> dict:
    """S9: the reaction to losing everything for a while."""
    reaction_s, mode = burst(start, burst_ms / 1e3)
    reaction = round(1e3 * reaction_s, 1) if np.isfinite(reaction_s) else "none"
    return {"burst_ms": burst_ms, "reaction_ms": reaction, "ends": mode.name.lower()}


def measure_losses(start: Lab, share: float, seconds: float, seed: int) -> dict:
    """S9: how often random losses stop the hand."""
    loss = measure_loss(start, share, seconds, seed)
    return vars(loss) | {"allowed": ALLOWED_TRIPS.get(share, 0)}


def measure_deaths(model: Path, bundle: Path, name: str, trials: int) -> dict:
    """S11 to S13: signals one of the processes."""
    done = [kill_one(model, bundle, name, seed) for seed in range(trials)]
    within = WITHIN_S[name.split()[0]]
    return {
        "fault": name,
        "trials": trials,
        "passed": sum(d.safe and d.reaction_s <= within for d in done),
        "within_ms": round(1e3 * within),
        "worst_ms": round(1e3 * max(d.reaction_s for d in done), 1),
    }


def measure_channel(model: Path, bundle: Path, name: str, trials: int) -> dict:
    """Double faults, floods and closed channels: from the fault to the order."""
    channel = next((c for c in CHANNELS if c.name == name), None)
    begin = time.monotonic()
    done = [
        stop_hand(model, bundle, seed)
        if channel is None
        else fail_channel(model, bundle, channel, seed)
        for seed in range(trials)
    ]
    within_s = WARNED_S if channel is None else channel.within_s
    took = [d.off_s for d in done]
    return {
        "fault": name,
        "trials": trials,
        "passed": sum(d.safe and d.off_s <= within_s for d in done),
        "safe": sum(d.safe for d in done),
        "within_ms": round(1e3 * within_s),
        "median_ms": _ms(float(np.median(took))),
        "worst_ms": _ms(max(took)),
        "minutes": round((time.monotonic() - begin) / 60, 1),
    }


def _ms(seconds: float) -> float | str:
    return round(1e3 * seconds, 1) if np.isfinite(seconds) else "never"


def measure(part: str, options: argparse.Namespace, model: Path) -> list[dict]:
    """Measures one part; returns its rows."""
    bundle, hz, seed = load_bundle(options.bundle), options.loop_hz, options.seed

    def walking(rate_hz: float) -> Lab:
        return Lab(model, (bundle,), loop_hz=rate_hz).activate().run(1.0)

    if part == "matrix":
        starts = snapshots(walking(hz), PHASES, SPACING_S)
        return [measure_scenario(starts, s, options.trials, seed) for s in SCENARIOS]
    if part == "starts":
        trials = options.start_trials
        return [measure_start(model, bundle, name, trials, hz) for name in STARTS]
    if part == "losses":
        start = walking(LINK_HZ)
        return [measure_losses(start, x, options.loss_s, seed) for x in LOSSES]
    if part == "bursts":
        start = walking(LINK_HZ)
        return [measure_burst(start, ms) for ms in BURSTS_MS]
    if part == "processes":
        trials = options.process_trials
        return [measure_deaths(model, options.bundle, n, trials) for n in SIGNALS]
    if part == "channels":
        trials = options.process_trials
        names = options.channels or [*(c.name for c in CHANNELS), STOPPED_HAND]
        return [measure_channel(model, options.bundle, n, trials) for n in names]
    return [fault_free(walking(hz), options.hours)]


def as_table(rows: list[dict]) -> str:
    """Rows as a Markdown table."""
    head = list(rows[0])
    lines = [head, ["---"] * len(head), *([str(v) for v in r.values()] for r in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def failed(row: dict) -> bool:
    """Whether a trial of a row did not end as the safety table says."""
    missing = row.get("passed", 0) < row.get("trials", 0)
    return missing or row.get("trips", 0) > row.get("allowed", 0)


def main() -> int:
    """Runs the measurement; returns 0 if everything passed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bundle", type=Path, default=WALKING)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--start-trials", type=int, default=20)
    parser.add_argument("--process-trials", type=int, default=3)
    parser.add_argument("--channels", nargs="+", help="only these rows of channels")
    parser.add_argument("--hours", type=float, default=0.05)
    parser.add_argument("--loss-s", type=float, default=30.0)
    parser.add_argument("--loop-hz", type=float, default=500.0)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    worst = 0
    with tempfile.TemporaryDirectory() as folder:
        model = write_model(Path(folder) / "hand.xml")
        for part in options.parts:
            rows = measure(part, options, model)
            worst += sum(map(failed, rows))
            print(f"{part}\n\n{as_table(rows)}\n", flush=True)
    print(f"{worst} rows failed" if worst else "everything passed")
    return int(worst > 0)


if __name__ == "__main__":
    sys.exit(main())
