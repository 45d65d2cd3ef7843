"""One page from the results of the other measurements.

`measure_all.py` calls it with what `step_time.py`, `loop_timing.py`, `install_size.py`
and `fuzz_bundles.py` print:

    python deploy/benchmarks/report.py --step S --loop L2=L … --size Z --fuzz F --out MD
"""

import argparse
import json
import os
import platform
import sys
from pathlib import Path

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


def page(step: list, loop: list, size: list, fuzz: dict) -> str:
    """The page."""
    for row in size:
        row["largest_mb"] = [f"{k} {v}" for k, v in list(row["largest_mb"].items())[:3]]
    parts = (
        "# The robot's side, measured",
        f"Written by `python deploy/benchmarks/report.py` on {platform.machine()}, "
        f"{os.cpu_count()} cores, Python {platform.python_version()}, with the "
        "committed crawl policy; `busy cores` tells what else ran meanwhile (the loop "
        "and its simulated hand take half of one). Not on the robot's computer.",
        "## A control step: observation, network, action, supervisor",
        "`step_time.py`. Wanted: median at most 0.5 ms, 99.9 % within 2 ms, memory "
        "flat within 1 MB, over 30 minutes' worth of steps.",
        table(step, STEP),
        "## The loop in real time, against a simulated hand in another process",
        "`loop_timing.py`. The hand walks all the time; a control step is missed if "
        "it ends more than 5 ms after its deadline or is skipped. Wanted under load "
        "(L2): at most 0.1 % missed. Without real-time priority (L3) it may miss, but "
        "must say so and hold. `hogs` are busy processes besides; `busy cores` counts "
        "everything. L4 is the gaps of the 500 Hz loop, L5 the long run.",
        table(loop, TIMING),
        PAUSES,
        table(loop, OUTCOME),
        "A stop is the supervisor's, with its reasons; the operator armed again at "
        "once.",
        "## Installed size and import",
        "`install_size.py`. Wanted: at most 40 MB with NumPy alone, 120 MB with ONNX "
        "Runtime (10⁶ bytes, nothing removed, without the byte code that Python writes "
        "at the first use); import within 0.5 s of processor time. The package is "
        "0.3 MB. NumPy's wheel alone is above the first limit, most of it a copy of "
        "OpenBLAS; the NumPy of Debian (and of Raspberry Pi OS, which is made of it) "
        "shares a small BLAS with the system.",
        table(size, SIZE),
        "## Damaged bundles",
        f"`fuzz_bundles.py`. {fuzz['damaged']} bundles with flipped bits, changed, "
        f"cut, inserted and swapped bytes and edited manifests (seed {fuzz['seed']}): "
        f"{fuzz['accepted']} accepted, {fuzz['not_one_line']} not refused in one line "
        f"with status 2. Of {fuzz['control']} policies with one flipped bit, ONNX "
        f"Runtime alone loads {fuzz['control_loaded']}.",
    )
    return "\n\n".join(parts) + "\n"


def main() -> int:
    """Writes the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--step", type=Path, required=True)
    parser.add_argument("--loop", metavar="ROW=FILE", nargs="+", required=True)
    parser.add_argument("--size", type=Path, required=True)
    parser.add_argument("--fuzz", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    read = [json.loads(path.read_text()) for path in (options.step, options.size)]
    loop = []
    for name, _, path in (word.partition("=") for word in options.loop):
        loop.append({"row": name, **json.loads(Path(path).read_text())})
    fuzz = json.loads(options.fuzz.read_text())
    options.out.write_text(page(read[0], loop, read[1], fuzz), "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
