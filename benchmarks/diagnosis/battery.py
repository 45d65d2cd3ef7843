"""Hides effects, asks the diagnosis, and prints how often it was right.

    python -m benchmarks.diagnosis.battery --seed 7 --records 100 --out battery

Every case is drawn from the seed and its number, so one of them can be run again with
`--only NUMBER`. Rows are written as they come; a second call with the same `--out` and
seed goes on where the first was stopped.
"""

import argparse
import json
import math
import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.diagnosis.hidden.cases import RATIOS, Case, draw_case
from benchmarks.diagnosis.hidden.sizes import SCALES
from benchmarks.diagnosis.hidden.truth import OUTSIDE
from benchmarks.diagnosis.score import Row, confusion, report, statistics

CATALOGUE = tuple(name for name in SCALES if name not in OUTSIDE)
SHARES = {
    "single": 0.5,
    "none": 0.3,
    "double": 0.08,
    "outside": 0.06,
    "invisible": 0.06,
}
VECTORS = ("encoder_eccentricity",)
"""Effects whose parameters are parts of one vector; errors are shares of its length."""

FULL = 700
"""Records of the full battery: 350 single ones (four for each effect and magnitude),
210 without effect."""


@dataclass(frozen=True)
class Task:
    """What to hide in one record."""

    number: int
    seed: int
    group: str
    effects: tuple[str, ...]
    magnitude: str
    kind: str


def plan(seed: int, records: int, effects: tuple[str, ...] = CATALOGUE) -> list[Task]:
    """Draws the tasks; effects and magnitudes take turns in a random order."""
    rng = np.random.default_rng([seed, 2])
    groups = [g for g, share in SHARES.items() for _ in range(round(share * records))]
    groups = groups[:records] + ["single"] * max(records - len(groups), 0)
    rng.shuffle(groups)
    pairs = [(e, m) for e in effects for m in RATIOS]
    singles = _turns(rng, pairs)
    outsiders = _turns(rng, list(OUTSIDE))
    tasks = []
    for number, group in enumerate(groups):
        hidden, magnitude = (), "medium"
        if group == "single":
            name, magnitude = next(singles)
            hidden = (name,)
        elif group == "double":
            # A pair is drawn from different effects; one alone would be a single.
            both = rng.choice(len(effects), 2, replace=False)
            hidden = tuple(effects[i] for i in both)
        elif group == "outside":
            hidden = (next(outsiders),)
        elif group == "invisible":
            hidden, magnitude = ("torque_limit",), "invisible"
        kinds = [SCALES[name].kinds for name in hidden] or [("pendulum", "joint")]
        shared = [k for k in kinds[0] if all(k in other for other in kinds)]
        light = [k for k in shared if k != "finger"] or shared
        kind = str(rng.choice(light))
        tasks.append(
            Task(number, seed * 100_003 + number, group, hidden, magnitude, kind)
        )
    return tasks


def _turns(rng, items: list):
    while True:
        for index in rng.permutation(len(items)):
            yield items[index]


def run_task(task: Task) -> Row:
    """Draws the case and diagnoses it."""
    from benchmarks.diagnosis.hidden.believed import believed, true_parameters
    from envs.errors import InputError
    from sysid.diagnosis.diagnose import diagnose

    case = draw_case(task.seed, task.effects, task.magnitude, task.kind)
    kind = task.kind
    if not _shown(task, case):
        kind = "pendulum"
        case = draw_case(task.seed, task.effects, task.magnitude, kind)
    common = {
        "group": task.group,
        "seed": task.seed,
        "kind": kind,
        "effects": task.effects,
        "joint": case.joint,
        "magnitude": task.magnitude,
        "ratio": case.ratio,
    }
    start = time.perf_counter()
    try:
        said = diagnose(list(case.logs), believed(case.stand), seed=task.seed)
    except InputError as error:
        return Row(**common, verdict="error", note=str(error))
    errors, covered = {}, {}
    for cause in said.causes:
        if cause.effect in task.effects and task.magnitude in RATIOS:
            true = true_parameters(case, cause.effect)
            for name, estimate in cause.parameters.items():
                if name in true and true[name] != 0.0:
                    key = f"{cause.effect}.{name}"
                    size = abs(true[name])
                    if cause.effect in VECTORS:
                        size = math.hypot(*true.values())
                    errors[key] = abs(estimate.value - true[name]) / size
                    covered[key] = bool(estimate.low <= true[name] <= estimate.high)
    same = [a for a in said.alternatives if not a.distinguishable]
    return Row(
        **common,
        verdict=said.verdict,
        causes=tuple(c.effect for c in said.causes),
        where=tuple(c.where for c in said.causes),
        alternatives=tuple(a.effect for a in same if a.cause == said.causes[0].effect),
        others=tuple(a.effect for a in same if a.cause != said.causes[0].effect),
        not_observable=said.not_observable,
        errors=errors,
        covered=covered,
        explained=said.gain.explained_fraction if said.gain else None,
        runtime_s=time.perf_counter() - start,
    )


def _shown(task: Task, case: Case) -> bool:
    """Whether a joint shows what is hidden, and stays within its range.

    A light one cannot show some effects, however large they are, and others throw it
    about: the pendulum can, and has a wide one.
    """
    from sysid.diagnosis.measured.checks import BEYOND_RAD

    if not task.effects or task.magnitude not in RATIOS:
        return True
    if case.ratio < 0.8 * RATIOS[task.magnitude]:
        return False
    log = case.logs[0]
    return all(
        low - BEYOND_RAD <= np.nanmin(angles) and np.nanmax(angles) <= high + BEYOND_RAD
        for link in case.stand.mechanism.links
        for low, high in [link.range_rad]
        for angles in [log.columns[f"pos.{link.name}"]]
    )


def main() -> None:
    """Runs the battery from the command line."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--seed", type=int, default=None, help="default: drawn")
    parser.add_argument("--records", type=int, default=FULL, help=f"default {FULL}")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--effects", nargs="+", default=list(CATALOGUE))
    parser.add_argument("--groups", nargs="+", default=list(SHARES))
    parser.add_argument("--only", type=int, nargs="+", help="numbers of cases")
    parser.add_argument("--out", type=Path, default=Path("battery"))
    args = parser.parse_args()
    seed = int.from_bytes(os.urandom(3)) if args.seed is None else args.seed
    print(f"seed {seed}, {args.records} records", flush=True)
    tasks = plan(seed, args.records, tuple(args.effects))
    tasks = [t for t in tasks if t.group in args.groups]
    if args.only is not None:
        tasks = [t for t in tasks if t.number in args.only]
    rows = _run(tasks, args.workers, args.out, seed)
    summary = {
        "seed": seed,
        "statistics": statistics(rows),
        "confusion": confusion(rows),
    }
    text = f"seed {seed}, {len(rows)} records\n{report(rows)}\n"
    (args.out / "battery.json").write_text(json.dumps(summary, indent=1))
    (args.out / "battery.txt").write_text(text)
    print(text)


def _run(tasks: list[Task], workers: int, out: Path, seed: int) -> list[Row]:
    """Runs what is not yet in the file of rows."""
    out.mkdir(parents=True, exist_ok=True)
    file = out / f"rows-{seed}.jsonl"
    lines = file.read_text().splitlines() if file.exists() else []
    done = {row.seed: row for row in map(Row.from_json, lines)}
    missing = [task for task in tasks if task.seed not in done]
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool, open(file, "a") as f:
        jobs = {pool.submit(run_task, task): task for task in missing}
        for job in as_completed(jobs):
            row = job.result()
            done[row.seed] = row
            f.write(row.to_json() + "\n")
            f.flush()
            hidden = "+".join(row.effects) or "none"
            print(
                f"{jobs[job].number:4d} {row.kind:9s} {hidden} ({row.magnitude} "
                f"{row.ratio:.2f}) -> {row.verdict} {'+'.join(row.causes)} "
                f"| {', '.join(row.alternatives)} {row.note} {row.runtime_s:.0f} s",
                flush=True,
            )
    wanted = {task.seed for task in tasks}
    return [row for key, row in done.items() if key in wanted]


if __name__ == "__main__":
    main()
