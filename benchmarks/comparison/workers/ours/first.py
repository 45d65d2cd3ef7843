"""This project's first PPO iteration, from the preset for CPUs or GPUs."""

import dataclasses
from importlib.metadata import version

import jax

from benchmarks.comparison.workers.ppo_settings import SETTINGS
from benchmarks.comparison.workers.report import arguments, say
from envs.rounding import fix_rounding
from fingers_mjx.ppo.config import PpoConfig, TrainConfig
from fingers_mjx.runs.setup import make_env, new_setup
from fingers_mjx.training.session import Session


def main() -> None:
    """Trains one iteration and says so."""
    fix_rounding()
    args = arguments()
    ppo = PpoConfig(
        unroll_length=SETTINGS["unroll"],
        epochs=SETTINGS["epochs"],
        minibatches=SETTINGS["minibatches"],
        actor_layers=tuple(SETTINGS["layers"]),
        critic_layers=tuple(SETTINGS["layers"]),
    )
    train = TrainConfig(
        num_envs=args.worlds, seed=args.seed, backend=args.backend, ppo=ppo
    )
    setup = dataclasses.replace(new_setup(TrainConfig(), None), train=train)
    session = Session(make_env(setup, args.worlds, args.backend), [setup])
    carry, _ = session.advance(session.start())
    jax.block_until_ready(carry.train)
    about = f"jax {version('jax')}, brax {version('brax')}"
    say(first=True, version=about, note="crawl")


if __name__ == "__main__":
    main()
