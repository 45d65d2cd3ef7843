"""Brax PPO on Playground's hand with a checkpoint and a restoration in its middle."""

# pyright: reportMissingImports=false
from importlib.metadata import version

import jax
import numpy as np

from benchmarks.comparison.plan import playground
from benchmarks.comparison.workers.playground.hand import HandStand
from benchmarks.comparison.workers.playground.train import train
from benchmarks.comparison.workers.report import DIFFERENCE, arguments, largest, say

HALF = 2


def main() -> None:
    """Trains whole and in halves, and compares."""
    args = arguments()
    folder = args.out / "checkpoints"
    folder.mkdir(parents=True, exist_ok=True)
    env = HandStand(args.mjcf, args.backend, args.worlds)

    def after(iterations: int, **more) -> list[np.ndarray]:
        _, params, _ = train(env, args.worlds, args.seed, iterations, **more)
        return [np.asarray(x) for x in jax.tree.leaves(params[1])]

    whole = after(2 * HALF)
    after(HALF, save_checkpoint_path=str(folder))
    saved = max(folder.iterdir(), key=lambda path: path.stat().st_mtime)
    rest = after(HALF, restore_checkpoint_path=str(saved))
    about = f"playground {version('playground')}, brax {version('brax')}"
    note = f"Brax's checkpoint restored after {HALF} of {2 * HALF} iterations; it holds"
    note += " networks and normalizer, neither optimizer, worlds nor random key"
    peer = playground("playground.resume", args.backend).peer
    shared = {"peer": peer, "version": about, "unit": "1"}
    apart = largest(whole, rest)
    say(quantity=DIFFERENCE, value=apart, note=note, **shared)
    say(done=True)


if __name__ == "__main__":
    main()
