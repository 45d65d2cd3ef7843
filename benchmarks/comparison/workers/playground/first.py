"""Brax PPO's first iteration on the hand as an environment of MuJoCo Playground."""

# pyright: reportMissingImports=false
from importlib.metadata import version

from benchmarks.comparison.workers.playground.hand import HandStand
from benchmarks.comparison.workers.playground.train import train
from benchmarks.comparison.workers.report import arguments, say


def main() -> None:
    """Trains one iteration and says so."""
    args = arguments()
    impl = args.backend
    train(HandStand(args.mjcf, impl, args.worlds), args.worlds, args.seed, 1)
    about = f"playground {version('playground')}, brax {version('brax')}"
    note = "same hand standing, evaluations off"
    say(first=True, version=f"{about}, jax {version('jax')}", note=note)


if __name__ == "__main__":
    main()
