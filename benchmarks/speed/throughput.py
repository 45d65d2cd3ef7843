"""Throughput of bare physics, environment and PPO of the same model in one run.

    python -m benchmarks.speed.throughput --backend cpu --against jax
    python -m benchmarks.speed.throughput --backend warp --num-envs 8192

Prints control steps per second of all worlds together (four physics steps each) and
the ratio to bare physics, which is native batch stepping: `mujoco.batch.Batch` for cpu,
MuJoCo Warp replaying a CUDA graph for warp, a scan of `mjx.step` for jax. Hands begin
in the stance, or near it; small random actions move them in the environment and in
PPO, and also in "bare, moving". Each number is the median over calls. On warp each
layer has a process of its own, one after the other; elsewhere they take turns in one.
Layers "... by substep" call Warp once a physics step instead of once a control step.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# Bare Warp allocates beside JAX, which would otherwise take most of the GPU's memory.
os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")

import jax
import mujoco

from benchmarks.speed.bare import Layer
from benchmarks.speed.layers import BY_SUBSTEP, LAYERS, MOVING
from envs.physics.backends import BACKENDS, default_backend
from envs.registry import make_batch, task_names
from envs.rounding import fix_rounding
from fingers_mjx.reports.page import commit_here
from fingers_mjx.runs.machine import machine

ROUNDS = 5
Key = tuple[str, str]
"""Backend and layer."""


def main() -> None:
    """Runs the layers that were asked for and prints the table."""
    fix_rounding()  # as the commands do
    args = _arguments()
    worlds = args.num_envs or (8192 if args.backend == "warp" else 256)
    print(f"{worlds} worlds of {args.task}, {machine()}", flush=True)
    named = args.layers or [x for x in LAYERS if x != MOVING or args.backend != "jax"]
    wanted = [(args.backend, name) for name in named]
    if args.against:
        wanted.append((args.against, "environment"))
    measure = _apart if args.backend == "warp" and len(wanted) > 1 else _together
    rates, notes = measure(args, wanted, worlds)
    for key, rate in rates.items():
        backend, name = key
        line = f"{backend:5} {name:30} {rate:12,.0f} control steps/s  {notes[key]}"
        print(line.rstrip(), flush=True)
    ratios = _ratios(rates, args.backend, args.against)
    for name, ratio in ratios.items():
        print(f"{name}: {ratio:.3g}")
    if args.json:
        rows = [
            {"backend": k[0], "layer": k[1], "steps_per_s": rate, "note": notes[k]}
            for k, rate in rates.items()
        ]
        record = {"task": args.task, "num_envs": worlds, **provenance()}
        record |= {"layers": rows, "ratios": ratios}
        args.json.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--task", choices=task_names(), default="crawl")
    parser.add_argument("--backend", choices=BACKENDS, default=default_backend())
    parser.add_argument(
        "--against", choices=BACKENDS, help="also time the environment on this backend"
    )
    parser.add_argument("--num-envs", type=int, help="default: warp 8192, else 256")
    parser.add_argument("--seconds", type=float, default=5.0, help="per layer")
    parser.add_argument(
        "--layers",
        nargs="*",
        choices=[*LAYERS, *BY_SUBSTEP],
        help="default: all but those by substep",
    )
    parser.add_argument("--json", type=Path)
    return parser.parse_args()


def _together(
    args: argparse.Namespace, wanted: list[Key], worlds: int
) -> tuple[dict[Key, float], dict[Key, str]]:
    """Returns rate and note of each layer, all in this process by turns."""
    layers = {key: _build(args.task, worlds, *key) for key in wanted}
    notes = {key: layer.note for key, layer in layers.items()}
    return _rates(layers, worlds, args.seconds), notes


def _apart(
    args: argparse.Namespace, wanted: list[Key], worlds: int
) -> tuple[dict[Key, float], dict[Key, str]]:
    """Returns rate and note of each layer, each in a process of its own.

    Warp's recorded graph of the bare layer does not survive that another layer loads
    the same kernels again: replaying it then ends the process.
    """
    rates, notes = {}, {}
    for backend, name in wanted:
        with tempfile.TemporaryDirectory() as folder:
            record = Path(folder) / "layer.json"
            options = ["--task", args.task, "--backend", backend]
            options += ["--num-envs", str(worlds), "--seconds", str(args.seconds)]
            options += ["--json", str(record), "--layers", name]
            program = [sys.executable, "-m", "benchmarks.speed.throughput"]
            subprocess.run([*program, *options], check=True)
            row = json.loads(record.read_text(encoding="utf-8"))["layers"][0]
        rates[backend, name], notes[backend, name] = row["steps_per_s"], row["note"]
    return rates, notes


def _build(task: str, worlds: int, backend: str, name: str) -> Layer:
    """Makes a layer and calls it once, which compiles it."""
    repeat = 4 if backend == "jax" and jax.default_backend() == "cpu" else 20
    start = time.perf_counter()
    build = (LAYERS | BY_SUBSTEP)[name]
    layer = build(make_batch(task, worlds, backend=backend), repeat)
    layer.call()
    seconds = time.perf_counter() - start
    print(f"{backend:5} {name:30} ready after {seconds:.1f} s", flush=True)
    return layer


def _rates(layers: dict[Key, Layer], worlds: int, seconds: float) -> dict[Key, float]:
    """Returns the median rate of each layer [control steps/s].

    The layers take turns, so that other work on the machine hits them alike.
    """
    rates: dict[Key, list[float]] = {key: [] for key in layers}
    for key, layer in ROUNDS * list(layers.items()):
        end = time.perf_counter() + seconds / ROUNDS
        while True:
            start = time.perf_counter()
            layer.call()
            now = time.perf_counter()
            rates[key].append(layer.steps * worlds / (now - start))
            if now >= end:
                break
    return {key: statistics.median(values) for key, values in rates.items()}


def _ratios(
    rates: dict[Key, float], backend: str, against: str | None
) -> dict[str, float]:
    """Returns how the layers compare, by sentence."""
    ratios = {}
    own = {name: rate for (of, name), rate in rates.items() if of == backend}
    bases = [name for name in ("bare physics", MOVING) if name in own]
    for base in bases:
        others = {name: rate for name, rate in own.items() if name not in bases}
        ratios |= {f"{name} / {base}": x / own[base] for name, x in others.items()}
    if against and "environment" in own:
        factor = own["environment"] / rates[against, "environment"]
        ratios[f"environment: {backend} / {against}"] = factor
    return ratios


def provenance() -> dict[str, object]:
    """Returns machine and commit, and the versions that the speed depends on most."""
    versions = {"jax": jax.__version__, "mujoco": mujoco.__version__}
    return {"machine": machine(), "commit": commit_here(), "versions": versions}


if __name__ == "__main__":
    main()
