"""Measures this project beside its peers and writes the rows.

    python -m benchmarks.comparison --out build/comparison
    python -m benchmarks.comparison --out build/comparison --device gpu --only speed
    python -m benchmarks.comparison --out build/comparison --here --together
    python -m benchmarks.comparison --out build/comparison --here mjlab=packages/mjlab
    python -m benchmarks.comparison.page

Each peer gets an environment of its own from pinned requirements. Measurements that
have rows for this kind of device are skipped, so that the command goes on where it
ended. A peer that cannot be installed, or that ends, gets a row with the reason.

On a machine without a network, install the peers beside this project and say `--here`,
with a folder of its own (`pip install --target`) for a peer that needs other versions;
with many cores and little time, `--together` readies the workers of all rates at once
and `--limit` ends a worker that hangs.
"""

import argparse
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from benchmarks.comparison.figures import Found
from benchmarks.comparison.measure import measure, rows
from benchmarks.comparison.place import Place
from benchmarks.comparison.plan import SEED, Job, jobs
from benchmarks.comparison.rows import Row, add_rows, lacking, read_rows
from benchmarks.comparison.turns import by_turns
from envs.hand.hand_file import load_hand_file
from envs.hand.standing_mjcf import standing_mjcf
from fingers_mjx.reports.page import commit_here


def main() -> int:
    """Runs from the command line."""
    args = _arguments()
    place = _place(args)
    place.out.mkdir(parents=True, exist_ok=True)
    place.mjcf.write_text(standing_mjcf(load_hand_file()), encoding="utf-8")
    kept, device = args.out / f"comparison-{args.device}.jsonl", machine(args.device)
    wanted = [job for job in jobs(args.device) if job.name.startswith(tuple(args.only))]
    kept_rows = read_rows(kept)
    for job in wanted:
        if not lacking(kept_rows, job.name, device):
            print(f"{job.name}: has its rows", flush=True)
    lacks = [job for job in wanted if lacking(kept_rows, job.name, device)]
    try:
        for job, found in _measured(lacks, place, args.together):
            add_rows(kept, _rows(job, found, args, device))
    except KeyboardInterrupt:
        print("stopped; the same command goes on", file=sys.stderr)
        return 130
    print(f"rows: {kept}")
    return 0


def machine(device: str) -> str:
    """What the figures are taken on; nothing that names the machine."""
    cores = f"{len(os.sched_getaffinity(0))} cores ({platform.machine()})"
    if device == "cpu":
        return f"CPU, {cores}"
    query = ["nvidia-smi", "--query-gpu=name", "--format=csv,noheader"]
    try:
        found = subprocess.run(query, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        raise SystemExit("--device gpu: nvidia-smi finds no GPU") from None
    return f"{found.stdout.splitlines()[0]}, {cores}"


def _measured(
    lacks: list[Job], place: Place, together: bool
) -> Iterator[tuple[Job, Found]]:
    """Measures job after job; `together` readies those of rates at once, and first."""
    if together:
        yield from by_turns([job for job in lacks if job.kind == "turns"], place)
        lacks = [job for job in lacks if job.kind != "turns"]
    for job in lacks:
        yield job, measure(job, place)


def _place(args: argparse.Namespace) -> Place:
    here = None if args.here is None else dict(args.here)
    return Place(args.out.absolute(), args.device, here, args.starts, args.limit)


def _rows(job: Job, found: Found, args: argparse.Namespace, device: str) -> list[Row]:
    command = f"python -m benchmarks.comparison --out DIR --device {args.device}"
    commit = args.commit or commit_here() or "unknown"
    shared = {"seed": SEED, "device": device, "commit": commit}
    command += f" --only {job.name}"
    if job.kind == "start":
        command += f" --starts {args.starts}"
    command += " --here" * (args.here is not None) + " --together" * args.together
    made = rows(job, found, command=command, **shared)
    for row in made:
        figure = row.note if row.value is None else f"{row.value:.4g} {row.unit}"
        print(f"{row.job}: {row.peer}: {row.quantity}: {figure}", flush=True)
    return made


def _own_folder(words: str) -> tuple[str, str]:
    peer, _, folder = words.partition("=")
    if not Path(folder or "=").is_dir():
        raise argparse.ArgumentTypeError(f"{words}: not PEER=DIR of a folder")
    return peer, str(Path(folder).absolute())


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    parser.add_argument("--device", choices=("cpu", "gpu"), default="cpu")
    parser.add_argument(
        "--only", nargs="+", default=[""], metavar="NAME", help="beginnings of names"
    )
    parser.add_argument(
        "--here",
        nargs="*",
        type=_own_folder,
        metavar="PEER=DIR",
        help="take peers from this environment, not from uv; DIR holds a peer's own",
    )
    parser.add_argument(
        "--together",
        action="store_true",
        help="ready the workers of all rates at once; for machines with many cores",
    )
    parser.add_argument(
        "--starts", type=int, default=3, metavar="N", help="starts of a worker, at most"
    )
    parser.add_argument(
        "--limit",
        type=float,
        default=float("inf"),
        metavar="SECONDS",
        help="what a worker has until it is ready, and for each answer",
    )
    parser.add_argument("--commit", metavar="NAME", help="of a source tree without git")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
