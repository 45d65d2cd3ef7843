"""Measures this project beside its peers and writes the rows.

    python -m benchmarks.comparison --out build/comparison
    python -m benchmarks.comparison --out build/comparison --device gpu --only speed
    python -m benchmarks.comparison.page benchmarks/results/comparison-cpu.jsonl

Each peer gets an environment of its own from pinned requirements. Measurements that
have rows for this kind of device are skipped, so that the command goes on where it
ended. A peer that cannot be installed, or that ends, gets a row with the reason.
"""

import argparse
import os
import platform
import subprocess
import sys
from pathlib import Path

from benchmarks.comparison.measure import measure, rows
from benchmarks.comparison.plan import SEED, Job, jobs
from benchmarks.comparison.process import Place
from benchmarks.comparison.rows import add_rows, lacking, read_rows
from envs.hand.hand_file import load_hand_file
from envs.hand.standing_mjcf import standing_mjcf
from fingers_mjx.reports.page import commit_here


def main() -> int:
    """Runs from the command line."""
    args = _arguments()
    place = Place(args.out.absolute(), args.device)
    place.out.mkdir(parents=True, exist_ok=True)
    place.mjcf.write_text(standing_mjcf(load_hand_file()), encoding="utf-8")
    kept, device = args.out / f"comparison-{args.device}.jsonl", machine(args.device)
    try:
        for job in jobs(args.device):
            if not any(job.name.startswith(name) for name in args.only):
                continue
            if lacking(read_rows(kept), job.name, device):
                add_rows(kept, _measured(job, place, device))
            else:
                print(f"{job.name}: has its rows", flush=True)
    except KeyboardInterrupt:
        print("stopped; the same command goes on", file=sys.stderr)
        return 130
    print(f"rows: {kept}")
    return 0


def machine(device: str) -> str:
    """What the figures are taken on; nothing that names the machine."""
    cores = f"{os.cpu_count()} cores ({platform.machine()})"
    if device == "cpu":
        return f"CPU, {cores}"
    query = ["nvidia-smi", "--query-gpu=name", "--format=csv,noheader"]
    try:
        found = subprocess.run(query, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        raise SystemExit("--device gpu: nvidia-smi finds no GPU") from None
    return f"{found.stdout.splitlines()[0]}, {cores}"


def _measured(job: Job, place: Place, device: str):
    command = f"python -m benchmarks.comparison --out DIR --device {place.device}"
    shared = {"seed": SEED, "device": device, "commit": commit_here() or "unknown"}
    command += f" --only {job.name}"
    made = rows(job, measure(job, place), command=command, **shared)
    for row in made:
        figure = row.note if row.value is None else f"{row.value:.4g} {row.unit}"
        print(f"{row.job}: {row.peer}: {row.quantity}: {figure}", flush=True)
    return made


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    parser.add_argument("--device", choices=("cpu", "gpu"), default="cpu")
    parser.add_argument(
        "--only", nargs="+", default=[""], metavar="NAME", help="beginnings of names"
    )
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
