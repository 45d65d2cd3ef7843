"""The fault matrix: every row of the safety table, many times, as a table.

    python deploy/benchmarks/faults/matrix.py --trials 100 --hours 1 --out OUT

writes `<out>.md` and `<out>.json` for the committed policy. Parts that an earlier call
left in `<out>.json` stay: `--parts links` measures only these again.
"""

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from faults.lab import Lab, snapshots
from faults.links import LOSSES, burst, measure_loss
from faults.processes import SIGNALS, WITHIN_S, kill_one
from faults.scenarios import SCENARIOS, Scenario
from faults.startup import STARTS, start_up, stopped_rightly
from faults.trials import passes, run_trial
from hand_files import WALKING, write_model
from stamp import sentence, stamp

from fingers_deploy.bundle import Bundle, load_bundle
from fingers_robot.safety import ROWS, Mode

PARTS = ("matrix", "starts", "links", "processes", "fault_free")
PHASES, SPACING_S = 20, 0.13
BURSTS_MS = (30, 60, 500)
ALLOWED_TRIPS = {0.5: 1}  # 20 lost packets in a row: once in a million
LINK_HZ = 500.0  # packets per second on the way from the hand


ELSEWHERE = """
- **S14, the whole computer hangs:** the board's watchdog (at most 15 s, see
  `docs/guides/deploy.md`); it cannot be measured without the board. Nothing arms at boot.
- **S16, another or a damaged policy:** refused before anything is opened, status 2 with
  one sentence (10,000 damaged bundles in `docs/results/deployment.md`). A policy is read
  once: what happens to its file later changes nothing (`deploy/tests/test_bundle.py`).
- **S19, flapping, two at once, while settling:** rows S3 and S19 above; every state
  with every input, and random sequences, in `deploy/tests/safety/test_machine.py`.
- **L7, jumps of the wall clock** by an hour, to 1970, back and forth: targets equal bit
  for bit (`deploy/tests/runtime/test_core.py`).
- **L1 to L5, timing:** `docs/results/deployment.md`."""


def measure_scenario(starts: list[Lab], scenario: Scenario, trials: int, seed: int):
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


def measure_start(model: Path, bundle: Bundle, name: str, trials: int, hz: float):
    """Runs one faulty start many times; returns its row of the results."""
    done = [start_up(model, bundle, name, k, hz) for k in range(trials)]
    good = [stopped_rightly(start, name) for start in done]
    return {
        "start": name,
        "trials": trials,
        "passed": sum(good),
        "step_rad": round(max(s.step_rad for s in done), 4),
    }


def fault_free(start: Lab, hours: float) -> dict:
    """Walks without a fault; every stop is a false one."""
    begin, seconds = start.clock.t, 3600 * hours
    while start.clock.t - begin < seconds and start.mode == Mode.ACTIVE:
        start.run(10.0)
    return {
        "hours": round((start.clock.t - begin) / 3600, 3),
        "false_trips": int(start.mode != Mode.ACTIVE),
        "events": [line for _, line in start.events][-4:],
    }


def measure(options: argparse.Namespace, folder: Path) -> dict:
    """Runs the parts that were asked for; returns the results."""
    model = write_model(folder / "hand.xml")
    bundle, hz = load_bundle(options.bundle), options.loop_hz
    lab = Lab(model, (bundle,), loop_hz=hz).activate().run(1.0)
    starts = snapshots(lab, PHASES, SPACING_S)
    parts: dict = {
        "matrix": lambda: [
            measure_scenario(starts, scenario, options.trials, options.seed)
            for scenario in SCENARIOS
        ],
        "starts": lambda: [
            measure_start(model, bundle, name, options.start_trials, hz)
            for name in STARTS
        ],
        "links": lambda: measure_links(model, bundle, options),
        "processes": lambda: _deaths(model, options.bundle, options.process_trials),
        "fault_free": lambda: fault_free(starts[1], options.hours),
    }
    results: dict = {
        "policy": bundle.manifest.task,
        "loop_hz": hz,
        "measured": {},
    }
    for name in options.parts:
        results["measured"][name] = stamp(_command(name, options), options.seed)
        results[name] = parts[name]()
        print(name, json.dumps(results[name]), file=sys.stderr)
    return results


def _command(part: str, options: argparse.Namespace) -> list[str]:
    """The command that measures one part alone, without its output."""
    size = {
        "matrix": ["--trials", options.trials],
        "starts": ["--start-trials", options.start_trials],
        "links": ["--loss-s", f"{options.loss_s:g}"],
        "processes": ["--process-trials", options.process_trials],
        "fault_free": ["--hours", f"{options.hours:g}"],
    }
    return ["fault_matrix.py", "--parts", part, *map(str, size[part])]


def measure_links(model: Path, bundle: Bundle, options: argparse.Namespace) -> dict:
    """S9: random losses for some time each, and bursts."""
    start = Lab(model, (bundle,), loop_hz=LINK_HZ).activate().run(1.0)
    bursts = [(ms, burst(start, ms / 1e3)) for ms in BURSTS_MS]
    return {
        "losses": [
            vars(measure_loss(start, share, options.loss_s, options.seed))
            | {"allowed": ALLOWED_TRIPS.get(share, 0)}
            for share in LOSSES
        ],
        "bursts": [
            {
                "burst_ms": ms,
                "reaction_ms": round(1e3 * t, 1) if np.isfinite(t) else "none",
                "ends": mode.name.lower(),
            }
            for ms, (t, mode) in bursts
        ],
    }


def _deaths(model: Path, bundle: Path, trials: int) -> list[dict]:
    rows = []
    for name in SIGNALS if trials else ():
        done = [kill_one(model, bundle, name, seed) for seed in range(trials)]
        within = WITHIN_S[name.split()[0]]
        rows.append(
            {
                "fault": name,
                "trials": trials,
                "passed": sum(d.safe and d.reaction_s <= within for d in done),
                "within_ms": round(1e3 * within),
                "worst_ms": round(1e3 * max(d.reaction_s for d in done), 1),
            }
        )
    return rows


def as_markdown(results: dict) -> str:
    """The results as a page."""
    free = results["fault_free"]
    when = {part: sentence(each) for part, each in results["measured"].items()}
    parts = [
        "# Safety table",
        "Written by `python deploy/benchmarks/faults/matrix.py`; see `docs/guides/deploy.md` "
        "for what a software supervisor is not. Everything here is measured on a "
        "simulated hand, on a desktop processor, never yet on a real one.",
        "## Rules",
        _table(_rules()),
        f"## Fault matrix\n\nPolicy: {results['policy']}; loop at "
        f"{results['loop_hz']:g} Hz in virtual time; every trial at a random phase of "
        "the gait. A trial passes if the reaction is on the wire in time, the mode at "
        "the end is the named one, no target jumps by more than α, nothing is sent "
        "after power was switched off, every target is finite and within the limits, "
        "and nothing raised. The times count from the fault, so that they "
        "include the wait for the next answer of the policy (20 ms) or read-back "
        "(200 ms), the fall (S7, 100 ms), or the pause of what flaps (500 ms). "
        "With no failure in 100 trials the failure rate is below "
        "3 % (95 %).",
        when["matrix"],
        _table(results["matrix"]),
        "## Before the policy runs",
        when["starts"],
        _table(results["starts"]),
        "## Packet loss (S9)\n\n500 packets per second, of which a share is lost at "
        "random: stops in this time. Below it, the reaction to losing everything for a "
        "while.",
        when["links"],
        _table(results["links"]["losses"]),
        _table(results["links"]["bursts"]),
        "## Real processes, in real time (S11, S12, S13)\n\nFor the supervisor it is "
        "the time to confirmed power off; until then the hand holds its last target.",
        when["processes"],
        _table(results["processes"]),
        f"## Without a fault\n\n{free['hours']} h of walking: "
        f"{free['false_trips']} false stops.",
        when["fault_free"],
        "## Rows that are not in the tables\n" + ELSEWHERE,
    ]
    return "\n\n".join(parts) + "\n"


def _rules() -> list[dict]:
    return [
        {
            "row": row.id,
            "fault": row.name,
            "rule": row.rule,
            "within [ms]": round(1e3 * row.within_s),
            "reaction": row.reaction.name.lower(),
            "then": ""
            if row.worse is None
            else f"{row.worse.name.lower()} after {1e3 * row.after_s:.0f} ms"
            + (" if it lasts" if row.lasting else ""),
            "cleared by": row.clear,
        }
        for row in ROWS
    ]


def _table(rows: list[dict]) -> str:
    head = list(rows[0])
    lines = [head, ["---"] * len(head), *([str(v) for v in r.values()] for r in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def main() -> int:
    """Runs the measurement; returns 0 if everything passed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bundle", type=Path, default=WALKING)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--start-trials", type=int, default=20)
    parser.add_argument("--process-trials", type=int, default=3)
    parser.add_argument("--hours", type=float, default=0.05)
    parser.add_argument("--loss-s", type=float, default=30.0)
    parser.add_argument("--loop-hz", type=float, default=500.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    start = time.time()
    with tempfile.TemporaryDirectory() as folder:
        results = measure(options, Path(folder))
    results["wall_s"] = round(time.time() - start)
    kept = options.out.with_suffix(".json")
    if kept.exists():
        before = json.loads(kept.read_text())
        results["measured"] = before["measured"] | results["measured"]
        results = before | results
    kept.write_text(json.dumps(results, indent=1) + "\n")
    if set(PARTS) <= set(results):
        options.out.with_suffix(".md").write_text(as_markdown(results), "utf-8")
    failed = _failed(results)
    print("\n".join(["failed:", *failed]) if failed else "everything passed")
    return 1 if failed else 0


def _failed(results: dict) -> list[str]:
    rows = [*results.get("matrix", ()), *results.get("starts", ())]
    rows += results.get("processes", ())
    failed = [str(row) for row in rows if row["passed"] < row["trials"]]
    losses = results.get("links", {}).get("losses", ())
    failed += [str(row) for row in losses if row["trips"] > row["allowed"]]
    free = results.get("fault_free", {"false_trips": 0})
    return failed + ([str(free)] if free["false_trips"] else [])


if __name__ == "__main__":
    sys.exit(main())
