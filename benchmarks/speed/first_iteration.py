"""First iteration of a population and of a run, each in a process of its own.

    python -m benchmarks.speed.first_iteration --backend warp 1x4096 8x4096
    python -m benchmarks.speed.first_iteration --backend cpu --preset cpu 1x64 4x64

A size is members x worlds of each. Caches of JAX, Warp and CUDA begin empty for each
size, so that it is started cold once and warm twice; then all again with other empty
caches, in the other order, cold only. Prints the time to the end of the first iteration
without that of Python's imports, as `benchmarks.speed.population` does.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

CACHES = {
    "JAX_COMPILATION_CACHE_DIR": "jax",
    "WARP_CACHE_PATH": "warp",
    "CUDA_CACHE_PATH": "cuda",
}
"""Variable and folder of each cache of compiled programs."""


def main() -> None:
    """Times all starts and prints a line for each."""
    args = _arguments()
    sizes = args.sizes
    with tempfile.TemporaryDirectory() as root:
        first, second = Path(root, "first"), Path(root, "second")
        turns = [("cold", first, sizes), ("warm", first, sizes[::-1])]
        turns += [("warm", first, sizes), ("cold", second, sizes[::-1])]
        starts: list[dict] = []
        for caches, folder, turn in turns:
            for size in turn:
                start = _start(size, folder / size, args)
                print(f"{size}, {caches}: {start['first_s']:.1f} s", flush=True)
                starts.append({"caches": caches, **start})
    if args.json:
        about = {k: starts[0][k] for k in ("machine", "commit", "versions")}
        kept = [{k: v for k, v in start.items() if k not in about} for start in starts]
        text = json.dumps({**about, "starts": kept}, indent=1)
        args.json.write_text(text + "\n", encoding="utf-8")


def _start(size: str, caches: Path, args: argparse.Namespace) -> dict:
    """Starts one population and returns what it measured, its size with it."""
    own = {name: str(caches / folder) for name, folder in CACHES.items()}
    for folder in own.values():
        Path(folder).mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(suffix=".json") as found:
        command = [sys.executable, "-m", "benchmarks.speed.population", size]
        command += ["--backend", args.backend, "--preset", args.preset]
        command += ["--iterations", "1", "--json", found.name]
        quiet = subprocess.DEVNULL
        subprocess.run(command, env=os.environ | own, check=True, stdout=quiet)
        said = json.loads(Path(found.name).read_text("utf-8"))
    return {**said.pop("sizes")[0], **said}


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("sizes", nargs="+", metavar="MEMBERSxWORLDS")
    parser.add_argument("--backend", default="warp")
    parser.add_argument("--preset", default="paper")
    parser.add_argument("--json", type=Path)
    return parser.parse_args()


if __name__ == "__main__":
    main()
