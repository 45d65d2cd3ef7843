"""One page from the results of the other measurements.

    python deploy/benchmarks/report.py --results OUT --out MD

reads what `measure_all.py` left in a folder; `measure_all.py --pages` calls it.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np
from goals import Results, goals
from stamp import sentence

STAMPS = "measured.json"
TIMING = {
    "row": "row",
    "minutes": "minutes",
    "scheduler": "scheduler",
    "load": "hogs",
    "busy_cores": "busy cores",
    "missed_percent": "missed [%]",
    "missed": "missed",
    "of_these_in_a_pause": "of these in a pause",
    "worst_skipped_in_a_row": "most skipped in a row",
    "late_p99_ms": "late 99 % [ms]",
    "late_p999_ms": "99.9 %",
    "late_max_ms": "worst",
    "late_percent_of_gaps": "gaps over 4 ms [%]",
    "gap_max_ms": "worst gap [ms]",
    "pauses": "pauses",
    "longest_pause_ms": "longest [ms]",
}
OUTCOME = {
    "row": "row",
    "steps_with_policy": "steps with policy",
    "warned": "told that it is late",
    "stops": "stops",
    "stops_after_a_pause": "of these after a pause",
    "why": "why",
    "memory_mb": "supervisor, policy [MB]",
    "growth_mb_per_h": "growth [MB/h]",
    "files": "files",
    "largest_file_mb": "largest [MB]",
}
PAUSES = """\
Pauses are what nothing inside helps against: this virtual machine is metered by its
host, which puts a core aside for up to 100 ms once both have been busy. A witness on
each core, a process of the highest priority that only sleeps, tells when (late by more
than 4 ms); a missed step or a stop counts as one of a pause only if a pause overlaps
it."""
GOAL = ("what", "wanted", "measured", "met")
STEP = ("runtime", "steps", "median_ms", "p999_ms", "worst_ms", "memory_growth_mb")
SIZE = (
    "machine",
    "extra",
    "installed_mb",
    "fingers_deploy_mb",
    "largest_mb",
    "import_s",
)


def table(rows: list[dict], columns: dict[str, str] | tuple[str, ...]) -> str:
    """Rows of results as a Markdown table; `columns` may give them other names."""
    names = columns if isinstance(columns, dict) else {name: name for name in columns}
    lines = [list(names.values()), ["---"] * len(names)]
    lines += [[_cell(row.get(name, "")) for name in names] for row in rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _cell(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return str(value)


def page(results: Results) -> str:
    """The page."""
    when = {name: sentence(stamp) for name, stamp in results.stamps.items()}
    loops = [{"row": name, **row} for name, row in results.loops.items()]
    fuzz = results.fuzz
    parts = (
        "# The robot's side, measured",
        "Written by `python deploy/benchmarks/report.py` from the results that "
        "`measure_all.py` keeps in `deploy/benchmarks/results`, with the committed "
        "crawl policy. Nothing here ran on the robot's computer.",
        "## What it must show",
        table([goal.row() for goal in goals(results)], GOAL),
        "The faults, row by row: [safety-table.md](safety-table.md).",
        "## A control step: observation, network, action, supervisor",
        when["step"],
        table(results.step, STEP),
        "## The loop in real time, against a simulated hand in another process",
        "The hand walks all the time; a control step is missed if it ends more than "
        "5 ms after its deadline or is skipped. Without real-time priority (L3) it may "
        "miss, but must say so and hold. `hogs` are busy processes besides; "
        "`busy cores` counts everything (the loop and its simulated hand take half of "
        "one). L4 is the gaps of the 500 Hz loop, L5 the long run.",
        table(loops, TIMING),
        PAUSES,
        table(loops, OUTCOME),
        "A stop is the supervisor's, with its reasons; the operator armed again at "
        "once.",
        "\n".join(f"- {name}: {when[f'loop {name}']}" for name in results.loops),
        "## Installed size and import",
        "10⁶ bytes, nothing removed, without the byte code that Python writes at the "
        "first use; import in processor time. NumPy's wheel alone is above the limit "
        "of 40 MB, most of it a copy of OpenBLAS; the NumPy of Debian (and of "
        "Raspberry Pi OS, which is made of it) shares a small BLAS with the system.",
        when["size"],
        table([_largest(row) for row in results.size], SIZE),
        "## Damaged bundles",
        f"{fuzz['damaged']} bundles with flipped bits, changed, cut, inserted and "
        f"swapped bytes and edited manifests: {fuzz['accepted']} accepted, "
        f"{fuzz['not_one_line']} not refused in one line with status 2. Of "
        f"{fuzz['control']} policies with one flipped bit, ONNX Runtime alone loads "
        f"{fuzz['control_loaded']}.",
        when["fuzz"],
        "## Typing, pushing, getting up and stopping under the supervisor",
        "The scenes and the committed policies are those of training; keys are asked "
        "for one by one, a cube is to come within 2 cm of its target; a fallen hand is "
        "armed for recovery in each of the fallen poses of training.",
        when["tasks"],
        table(_tasks(results.tasks), ("task", "trials", "result", "stopped by")),
        "## Walking under disturbances",
        "The figure is in [deploy.md](deploy.md). " + when["disturbances"],
    )
    return "\n\n".join(parts) + "\n"


def _largest(row: dict) -> dict:
    largest = list(row["largest_mb"].items())[:3]
    return row | {"largest_mb": [f"{name} {size}" for name, size in largest]}


def _tasks(tasks: dict[str, list[dict]]) -> list[dict]:
    rows = []
    for name, runs in tasks.items():
        faults = sorted({fault for run in runs for fault in run.get("faults", ())})
        trials, result = len(runs), ""
        if "keys" in runs[0]:
            latency = np.median([x for run in runs for x in run["latency_s"]])
            hits, keys = (sum(run[k] for run in runs) for k in ("correct", "keys"))
            result = f"{hits} of {keys} keys, {latency:.2f} s after the request"
        elif "delivered" in runs[0]:
            result = f"{sum(run['delivered'] for run in runs)} delivered"
        elif "up" in runs[0]:
            up = [run for run in runs if run["up"]]
            median = np.median([run["after_s"] for run in up])
            result = f"{len(up)} stand under the crawl policy again, {median:.1f} s"
        else:
            trials = sum(run["stops"] for run in runs)
            result = "; ".join(
                f"{run['falls']} of {run['stops']} fell, {run['wait_s']:g} s after the "
                "last command"
                for run in runs
            )
        row = {"task": name, "trials": trials, "result": result}
        rows.append(row | {"stopped by": ", ".join(faults)})
    return rows


def read_results(folder: Path) -> Results:
    """Reads what `measure_all.py` left in a folder."""

    def read(name: str):
        return json.loads((folder / f"{name}.json").read_text("utf-8"))

    loops = sorted(folder.glob("loop *.json"))
    return Results(
        step=read("step"),
        size=read("size"),
        fuzz=read("fuzz"),
        tasks=read("tasks"),
        loops={file.stem.removeprefix("loop "): read(file.stem) for file in loops},
        faults=read("faults"),
        figure=read("disturbances"),
        stamps=json.loads((folder / STAMPS).read_text("utf-8")),
    )


def main() -> int:
    """Writes the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--results", type=Path, required=True, help="folder")
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    options.out.write_text(page(read_results(options.results)), "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
