r"""Hides effects, asks the diagnosis, and prints how often it was right.

    PYTHONPATH=.:deploy python -m benchmarks.diagnosis.battery \
        --wide --seed 5309 --only 0-699 --workers 30 --out wide

`--wide` draws every record under conditions of its own: rig, command path, effort, how
well gains are known, rate, jitter, repeats, motion and scale; without it all records
are those of the usual stand (`--seed 3107`). A case is drawn from the seed and its
number, so some can be run again, or elsewhere, with `--only 7 20-39`. A row is written
as its record finishes, into `OUT/wide-SEED.jsonl`; a second call with the same `--out`
and seed goes on where the first was stopped. Nothing needs to be installed but the
dependencies (Python 3.12, jax 0.11.2).
"""

import argparse
import json
import math
import multiprocessing
import os
import signal
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.diagnosis.factors import by_factor
from benchmarks.diagnosis.hidden.cases import RATIOS, Case, drawn_case
from benchmarks.diagnosis.plan import (
    CATALOGUE,
    FULL,
    SHARES,
    Task,
    plan,
    redrawn,
    wide_plan,
)
from benchmarks.diagnosis.score import Row, confusion, read_rows, report, statistics
from fingers_mjx.studies.sweep.engines.held import CORES, Held, cores
from sysid.diagnosis.whole_loops import compile_loops_whole

RECORDS_OF_A_PROCESS = 12
"""After so many records a process is replaced: compiled programs take its memory."""

REACHED = (0.8, 1.5)
"""Shares of the visibility that is asked for between which a record shows it."""

REDRAWN = 8
"""So many effects are tried until a record shows one."""

VECTORS = ("encoder_eccentricity",)
"""Effects whose parameters are parts of one vector; errors are shares of its length."""


def run_task(task: Task) -> Row:
    """Draws the case and diagnoses it; whatever is raised is in the row."""
    started = time.perf_counter()
    try:
        task, case = _case(task)
        row = _row(task, case)
        return replace(row, **_verdict_on(task, case))
    except Exception as error:
        blank = Row(task.group, task.seed, task.kind, task.effects, "", task.magnitude,
                    1.0, "error", conditions=task.conditions.levels())  # fmt: skip
        note = f"{type(error).__name__}: {error}"[:300]
        return replace(blank, note=note, runtime_s=time.perf_counter() - started)


def _case(task: Task) -> tuple[Task, Case]:
    """Draws the case; on a pendulum where the rig does not show what is hidden.

    What a pendulum does not show as it should either, at any size, gives its place to
    another effect: the magnitude of a row is what its record shows.
    """
    for again in range(REDRAWN):
        case = _drawn(task)
        if not _shown(task, case) and "joint_coupling" not in task.effects:
            task = replace(task, conditions=replace(task.conditions, rig="pendulum"))
            case = _drawn(task)
        if _shown(task, case):
            return task, case
        task = redrawn(task, again)
    raise RuntimeError(f"none of {REDRAWN} effects shows as it should")


def _drawn(task: Task) -> Case:
    return drawn_case(task.seed, task.effects, task.magnitude, task.conditions)


def _row(task: Task, case: Case) -> Row:
    """What was hidden; the verdict is still missing."""
    return Row(
        group=task.group,
        seed=task.seed,
        kind=task.kind,
        effects=task.effects,
        joint=case.joint,
        magnitude=task.magnitude,
        ratio=case.ratio,
        verdict="",
        conditions=task.conditions.levels(),
    )


def _verdict_on(task: Task, case: Case) -> dict:
    """Fields of a row that the diagnosis gives."""
    from benchmarks.diagnosis.hidden.believed import believed, true_parameters
    from sysid.diagnosis.diagnose import examine
    from sysid.diagnosis.verdict.evidence import evidence

    mechanism = believed(case.stand, task.conditions.effort)
    start = time.perf_counter()
    said, joints = examine(list(case.logs), mechanism, seed=task.seed)
    runtime_s = time.perf_counter() - start
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
    closed = said.residual_gains.get("position")
    return {
        "verdict": said.verdict,
        "causes": tuple(c.effect for c in said.causes),
        "where": tuple(c.where for c in said.causes),
        "alternatives": tuple(
            a.effect for a in same if a.cause == said.causes[0].effect
        ),
        "others": tuple(a.effect for a in same if a.cause != said.causes[0].effect),
        "not_observable": said.not_observable,
        "errors": errors,
        "covered": covered,
        "explained": said.gain.explained_fraction if said.gain else None,
        "closed_loop": (closed.heldout_rmse_before, closed.heldout_rmse_after)
        if closed
        else (),
        "signs": said.unexplained,
        "evidence": {
            j.track.joint: {"+".join(k): v for k, v in evidence(j.search).items()}
            for j in joints
            if j.search is not None
        },
        "runtime_s": runtime_s,
    }


def _shown(task: Task, case: Case) -> bool:
    """Whether a joint shows what is hidden, and stays within its range.

    A light one cannot show some effects, however large they are, and others throw it
    about: the pendulum can, and has a wide one.
    """
    from sysid.diagnosis.measured.checks import BEYOND_RAD

    if not task.effects or task.magnitude not in RATIOS:
        return True
    low, high = (share * RATIOS[task.magnitude] for share in REACHED)
    if not low < case.ratio < high:
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
    compile_loops_whole()  # as the command does
    # As Ctrl-C does, whose exception ends the pool's processes, too.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--seed", type=int, default=None, help="default: drawn")
    parser.add_argument("--wide", action="store_true", help="conditions of their own")
    parser.add_argument("--records", type=int, default=FULL, help=f"default {FULL}")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--effects", nargs="+", default=list(CATALOGUE))
    parser.add_argument("--groups", nargs="+", default=list(SHARES))
    parser.add_argument("--only", type=numbers, nargs="+", help="cases: 7 20-39")
    parser.add_argument("--out", type=Path, default=Path("battery"))
    args = parser.parse_args()
    seed = int.from_bytes(os.urandom(3)) if args.seed is None else args.seed
    only = None if args.only is None else {n for part in args.only for n in part}
    print(f"seed {seed}, {args.records} records", flush=True)
    effects = tuple(args.effects)
    if args.wide:
        chosen = sorted(only) if only is not None else range(args.records)
        tasks = wide_plan(seed, chosen, effects)
    else:
        tasks = plan(seed, args.records, effects)
    tasks = [t for t in tasks if t.group in args.groups]
    tasks = [t for t in tasks if only is None or t.number in only]
    name = "wide" if args.wide else "rows"
    rows = run_all(tasks, args.workers, args.out, f"{name}-{seed}.jsonl")
    summary = {
        "seed": seed,
        "statistics": statistics(rows),
        "confusion": confusion(rows),
    }
    text = f"seed {seed}, {len(rows)} records\n{report(rows)}\n"
    text += f"\n{by_factor(rows)}\n" if args.wide else ""
    (args.out / "battery.json").write_text(json.dumps(summary, indent=1))
    (args.out / "battery.txt").write_text(text)
    print(text)


def numbers(text: str) -> range:
    """Reads `7` or `20-39`; both ends count."""
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1)


def _take_core() -> None:
    """Keeps this process on a core of its own: XLA's threads would share all."""
    if own := Held(CORES, cores(), 1).names:  # until the process ends
        os.sched_setaffinity(0, map(int, own))


def run_all(tasks: list[Task], workers: int, out: Path, name: str) -> list[Row]:
    """Runs what is not yet in the file of rows, and returns the rows of the tasks.

    Args:
        tasks: what is hidden where.
        workers: processes at the same time.
        out: directory of the file, which is made.
        name: of the file, to which a row is added as its record finishes.
    """
    out.mkdir(parents=True, exist_ok=True)
    file = out / name
    read = read_rows(file) if file.exists() else []
    done = {row.seed: row for row in read}
    missing = [task for task in tasks if task.seed not in done]
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    numbers = {task.seed: task.number for task in missing}
    spawn = multiprocessing.get_context("spawn")
    # An executor with as few tasks for a child waits for ever when one has done them.
    pool = spawn.Pool(workers, _take_core, maxtasksperchild=RECORDS_OF_A_PROCESS)
    with pool, open(file, "a") as f:
        for row in pool.imap_unordered(run_task, missing):
            done[row.seed] = row
            f.write(row.to_json() + "\n")
            f.flush()
            hidden = "+".join(row.effects) or "none"
            print(
                f"{numbers[row.seed]:4d} {row.kind:9s} {hidden} ({row.magnitude} "
                f"{row.ratio:.2f}) -> {row.verdict} {'+'.join(row.causes)} "
                f"| {', '.join(row.alternatives)} {row.note} {row.runtime_s:.0f} s",
                flush=True,
            )
    wanted = {task.seed for task in tasks}
    return [row for key, row in done.items() if key in wanted]


if __name__ == "__main__":
    main()
