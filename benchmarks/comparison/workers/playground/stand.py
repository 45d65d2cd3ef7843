"""Brax PPO on the hand of MuJoCo Playground until its hands stand."""

# pyright: reportMissingImports=false
from importlib.metadata import version

from benchmarks.comparison.workers.playground.hand import HandStand
from benchmarks.comparison.workers.playground.train import train
from benchmarks.comparison.workers.ppo_settings import SETTINGS
from benchmarks.comparison.workers.report import STANDING_STEPS, arguments, say

ITERATIONS = 3000


def main() -> None:
    """Trains until episodes that end are long, and says so."""
    args = arguments()
    about = f"playground {version('playground')}, brax {version('brax')}"
    about += f", jax {version('jax')}"
    said = []

    def progress(steps: int, metrics: dict) -> None:
        if not said and metrics.get("episode/length", 0.0) >= STANDING_STEPS:
            said.append(steps)
            say(first=True, version=about, note="same hand standing, evaluations off")

    env = HandStand(args.mjcf, args.backend, args.worlds)
    more = {"log_training_metrics": True, "progress_fn": progress}
    more["training_metrics_steps"] = args.worlds * SETTINGS["unroll"]
    train(env, args.worlds, args.seed, ITERATIONS, **more)
    raise SystemExit("RuntimeError: episodes stayed short to the end")


if __name__ == "__main__":
    main()
