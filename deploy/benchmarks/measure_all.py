"""Every measurement of the robot's side, one after the other, and both pages from them.

    python deploy/benchmarks/measure_all.py --out OUT            # about 5 hours, idle
    python deploy/benchmarks/measure_all.py --out OUT --small    # some minutes: a trial
    python deploy/benchmarks/measure_all.py --out OUT --pages docs --only

Results stay in OUT as JSON; what is there already is not measured again, so that a run
may be cut off and gone on with (delete a file to measure it anew). `--pages` writes
`safety-table.md`, `deploy-results.md` and the figure. The rows L1 to L5 mean something
on an idle machine only.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from faults.matrix import as_markdown
from report import STAMPS, page, read_results
from stamp import stamp
from walking_quality import draw

HERE = Path(__file__).parent
FAULTS, FIGURE = "faults", "disturbances"


@dataclass(frozen=True)
class Part:
    """One measurement.

    Attributes:
        name: of its file in the folder of results.
        program: script and its options at full size.
        small: options that replace those for a trial.
        prints: the script prints its results; else it takes `--out`.
    """

    name: str
    program: tuple[str, ...]
    small: tuple[str, ...] = ()
    prints: bool = True


def _loop(name: str, minutes: int, *more: str) -> Part:
    timing = ("loop_timing.py", *more, "--minutes")
    return Part(f"loop {name}", (*timing, f"{minutes}"), (*timing, "0.3"))


def _faults(part: str, full: tuple[str, ...], small: tuple[str, ...]) -> Part:
    program = ("fault_matrix.py", "--parts", part)
    return Part(f"{FAULTS} {part}", (*program, *full), (*program, *small), prints=False)


PARTS = (
    Part(
        "step",
        ("step_time.py", "--minutes", "30"),
        ("step_time.py", "--minutes", "0.5"),
    ),
    Part("size", ("install_size.py",), ("install_size.py",)),
    Part(
        "fuzz",
        ("fuzz_bundles.py", "--count", "10000"),
        ("fuzz_bundles.py", "--count", "120"),
    ),
    _faults("matrix", ("--trials", "100"), ("--trials", "1")),
    _faults("starts", ("--start-trials", "100"), ("--start-trials", "1")),
    _faults("links", ("--loss-s", "600"), ("--loss-s", "2")),
    _faults("fault_free", ("--hours", "1"), ("--hours", "0.003")),
    Part(
        "tasks", ("task_runs.py", "--trials", "10"), ("task_runs.py", "--trials", "1")
    ),
    Part(
        FIGURE,
        ("walking_quality.py",),
        ("walking_quality.py", "--seconds", "1", "--trials", "1"),
        prints=False,
    ),
    # In real time from here on.
    _faults("processes", ("--process-trials", "50"), ("--process-trials", "1")),
    _loop("L1", 10),
    _loop("L1 plain", 10, "--no-realtime"),
    _loop("L2", 10, "--load", "2"),
    _loop("L2 again", 10, "--load", "2"),  # together 60 misses are 0.1 %
    _loop("L3", 10, "--load", "2", "--no-realtime"),
    _loop("L5", 120),
)


def measure(part: Part, out: Path, small: bool) -> bool:
    """Runs one measurement, if it is not there yet; returns whether it went well."""
    faults = part.name.startswith(FAULTS)
    kept = out / f"{part.name}.{'done' if faults else 'json'}"
    if kept.exists():
        print(f"{part.name}: there already", flush=True)
        return True
    script, *options = part.small if small else part.program
    target = [] if part.prints else ["--out", str(out / part.name.split()[0])]
    begin, measured = time.monotonic(), stamp([script, *options])
    done = subprocess.run(
        [sys.executable, str(HERE / script), *options, *target],
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    print(f"{part.name}: {time.monotonic() - begin:.0f} s", flush=True)
    if done.returncode:
        print(f"{part.name}: status {done.returncode}\n{done.stdout}", flush=True)
        return False
    if part.prints or faults:
        kept.write_text(done.stdout, "utf-8")
    if not faults:  # those keep it with their results
        stamps = read_stamps(out) | {part.name: measured}
        (out / STAMPS).write_text(json.dumps(stamps, indent=1) + "\n", "utf-8")
    return True


def read_stamps(out: Path) -> dict[str, dict]:
    """When and how each part in a folder of results was measured."""
    path = out / STAMPS
    return json.loads(path.read_text("utf-8")) if path.exists() else {}


def write_pages(out: Path, pages: Path) -> None:
    """Writes both pages and the figure from the results."""
    parts = ["step", "size", "fuzz", "tasks", FAULTS, FIGURE, "loop L1", "loop L2"]
    missing = [name for name in parts if not (out / f"{name}.json").exists()]
    if missing:
        raise SystemExit(f"no pages: {', '.join(missing)} not measured yet")
    results = read_results(out)
    (pages / "deploy-results.md").write_text(page(results), "utf-8")
    (pages / "safety-table.md").write_text(as_markdown(results.faults), "utf-8")
    (pages / "images").mkdir(exist_ok=True)
    draw(results.figure, pages / "images" / f"deploy-{FIGURE}.png")


def main() -> int:
    """Measures; returns 0 if all of it went well."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of results")
    parser.add_argument("--small", action="store_true", help="a trial of everything")
    parser.add_argument("--parts", nargs="+", choices=[p.name for p in PARTS])
    parser.add_argument("--pages", type=Path, metavar="DOCS", help="write the pages")
    parser.add_argument("--only", action="store_true", help="the pages, nothing else")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    busy = os.getloadavg()[0]
    if busy > 0.5 and not options.only:
        print(f"NOT IDLE: load {busy:.1f}; L1 to L5 will say little", flush=True)
    chosen = [p for p in PARTS if not options.parts or p.name in options.parts]
    parts = [] if options.only else chosen
    well = [measure(part, options.out, options.small) for part in parts]
    if options.pages:
        write_pages(options.out, options.pages)
    return 0 if all(well) else 1


if __name__ == "__main__":
    sys.exit(main())
