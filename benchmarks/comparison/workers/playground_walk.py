"""Brax PPO on the hand of MuJoCo Playground, paid for walking, for a given time."""

# pyright: reportMissingImports=false
from importlib.metadata import version

from benchmarks.comparison.workers.playground_hand import HandWalk
from benchmarks.comparison.workers.playground_train import train
from benchmarks.comparison.workers.ppo_settings import SETTINGS
from benchmarks.comparison.workers.report import arguments
from benchmarks.comparison.workers.walking import COMMAND_MPS, ITERATIONS, Walking


def main() -> None:
    """Trains until the time is over, and says how fast the hand walks."""
    args = arguments()
    about = f"playground {version('playground')}, brax {version('brax')}"
    about += f", jax {version('jax')}"
    note = f"same hand, {COMMAND_MPS} m/s forward, MJX on {args.backend}"
    walking = Walking(args.seconds, about, note)

    def progress(steps: int, metrics: dict) -> None:
        length, speed = (
            float(metrics.get(f"episode/{name}", 0.0))
            for name in ("length", "speed_per_step")
        )
        walking.over(length, speed)

    env = HandWalk(args.mjcf, args.backend, args.worlds)
    more = {"log_training_metrics": True, "progress_fn": progress}
    more["training_metrics_steps"] = args.worlds * SETTINGS["unroll"]
    train(env, args.worlds, args.seed, ITERATIONS, **more)


if __name__ == "__main__":
    main()
