"""One page from the results of the other measurements.

Run `step_time.py`, `loop_timing.py`, `install_size.py` and `fuzz_bundles.py` first;
each prints JSON. Then

    python deploy/benchmarks/report.py --step S --loop L … --size Z --fuzz F --out MD
"""

import argparse
import json
import os
import platform
import sys
from pathlib import Path

LOOP = (
    "load",
    "scheduler",
    "control_steps",
    "late_over_5ms",
    "skipped",
    "late_p999_ms",
    "late_max_ms",
    "gaps_over_4ms",
    "gap_max_ms",
    "answer_p999_ms",
    "stolen_s",
    "memory_mb",
    "stops",
    "why",
)


def table(rows: list[dict], columns: tuple[str, ...]) -> str:
    """Rows of results as a Markdown table."""
    lines = [columns, ["---"] * len(columns)]
    lines += [[_cell(row.get(column, "")) for column in columns] for row in rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _cell(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return str(value)


def page(step: list, loop: list, size: list, fuzz: dict) -> str:
    """The page."""
    step_columns = ("runtime", "steps", "median_ms", "p999_ms", "memory_growth_mb")
    size_columns = (
        "machine",
        "extra",
        "installed_mb",
        "fingers_deploy_mb",
        "largest_mb",
        "of_that_tests_and_stubs_mb",
        "import_s",
    )
    for row in size:
        row["largest_mb"] = [f"{k} {v}" for k, v in list(row["largest_mb"].items())[:3]]
    parts = (
        "# The robot's side, measured",
        f"Written by `python deploy/benchmarks/report.py` on {platform.machine()}, "
        f"{os.cpu_count()} cores, Python {platform.python_version()}, while other work "
        "ran. Not on the robot's computer.",
        "## A control step: observation, network, action, supervisor",
        "Wanted: median at most 0.5 ms, 99.9 % within 2 ms, memory flat within 1 MB.",
        table(step, step_columns),
        "## The loop in real time, against a simulated hand in another process",
        "Wanted: at most 0.1 % of the control steps more than 5 ms late; without "
        "real-time priority it may miss, but must say so and hold. A stop is the "
        "supervisor's; its reasons are beside it. `stolen_s` is the time that the "
        "host of this virtual machine took from it: nothing inside helps against that.",
        table(loop, LOOP),
        "## Installed size and import",
        "Wanted: at most 40 MB with NumPy alone, 120 MB with ONNX Runtime (10⁶ bytes, "
        "nothing removed); import within 0.5 s of processor time. The package is "
        "0.3 MB; NumPy's own wheel is already above the first limit.",
        table(size, size_columns),
        "## Damaged bundles",
        f"{fuzz['damaged']} bundles with flipped bits, changed, cut, inserted and "
        f"swapped bytes and edited manifests (seed {fuzz['seed']}): "
        f"{fuzz['accepted']} accepted, {fuzz['not_one_line']} not refused in one line.",
    )
    return "\n\n".join(parts) + "\n"


def main() -> int:
    """Writes the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--step", type=Path, required=True)
    parser.add_argument("--loop", type=Path, nargs="+", required=True)
    parser.add_argument("--size", type=Path, required=True)
    parser.add_argument("--fuzz", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    read = [json.loads(path.read_text()) for path in (options.step, options.size)]
    loop = [json.loads(path.read_text()) for path in options.loop]
    fuzz = json.loads(options.fuzz.read_text())
    options.out.write_text(page(read[0], loop, read[1], fuzz), "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
