"""This project's complete crawl environment, with small random actions."""

from importlib.metadata import version
from typing import Any

import jax

from benchmarks.comparison.workers.report import STEPS_PER_CALL, arguments, serve
from benchmarks.speed.layers import environment
from envs.registry import make_batch
from envs.rounding import fix_rounding


def main() -> None:
    """Builds the worlds and answers the command."""
    fix_rounding()
    args = arguments()
    batch = make_batch("crawl", args.worlds, backend=args.backend)
    repeat = STEPS_PER_CALL[args.device]
    layer: Any = environment(batch, repeat)

    def call() -> int:
        layer.call()
        return layer.steps * args.worlds

    if args.device == "gpu" and jax.default_backend() != "gpu":
        raise SystemExit("JAX found no GPU")
    about = f"mujoco {version('mujoco')}, jax {version('jax')}"
    serve(call, version=about, note="crawl: drive, randomized models, 8 samples of 49")


if __name__ == "__main__":
    main()
