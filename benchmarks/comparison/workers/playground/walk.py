"""Brax PPO on the hand of MuJoCo Playground, paid for walking, for a given time."""

# pyright: reportMissingImports=false
from importlib.metadata import version

from benchmarks.comparison.workers.playground.hand import HandWalk
from benchmarks.comparison.workers.playground.train import networks_of, train
from benchmarks.comparison.workers.playground.watched import watching
from benchmarks.comparison.workers.ppo_settings import SETTINGS
from benchmarks.comparison.workers.report import arguments
from benchmarks.comparison.workers.walking import (
    COMMAND_MPS,
    ITERATIONS,
    LAYERS,
    Walking,
)


def main() -> None:
    """Trains until the time is over, and says how fast the hand walks."""
    args = arguments()
    about = f"playground {version('playground')}, brax {version('brax')}"
    about += f", jax {version('jax')}"
    note = f"same hand, {COMMAND_MPS} m/s forward, MJX on {args.backend}"
    walking = Walking(args.seconds, about, note)

    def look(speed_mps: float, falls: float) -> None:
        walking.over(SETTINGS["unroll"], speed_mps, falls)

    env = HandWalk(args.mjcf, args.backend, args.worlds)
    own = {"wrap_env_fn": watching(look), "network_factory": networks_of(LAYERS)}
    train(env, args.worlds, args.seed, ITERATIONS, **own)


if __name__ == "__main__":
    main()
