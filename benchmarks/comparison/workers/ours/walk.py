"""This project's crawl, trained with a preset for a given time."""

import dataclasses
from collections.abc import Callable
from importlib.metadata import version

from benchmarks.comparison.workers.report import arguments
from benchmarks.comparison.workers.walking import ITERATIONS, LAYERS, Walking
from envs.rounding import fix_rounding
from fingers_mjx.ppo.config import preset
from fingers_mjx.ppo.totals import means
from fingers_mjx.runs.setup import Setup, new_setup, training_env
from fingers_mjx.training.session import Session


def main() -> None:
    """Trains until the time is over, and says how fast the hand walks."""
    train_to_walk(lambda setup: setup, "commands of training")


def train_to_walk(changed: Callable[[Setup], Setup], note: str) -> None:
    """Trains the crawl with the changes to its settings that `changed` makes.

    Args:
        changed: takes the preset's settings and returns those to train with.
        note: what these are, for the row.
    """
    fix_rounding()
    args = arguments()
    name = "cpu" if args.device == "cpu" else "fast"
    own = {"num_envs": args.worlds, "seed": args.seed, "backend": args.backend}
    own |= {"spread_ends": True, "iterations_per_call": 1}
    train = dataclasses.replace(preset(name, "crawl"), **own)
    layers = {"actor_layers": LAYERS, "critic_layers": LAYERS}
    train = dataclasses.replace(train, ppo=dataclasses.replace(train.ppo, **layers))
    setup = changed(dataclasses.replace(new_setup(train, None), train=train))
    session = Session(training_env(setup), [setup])
    about = f"jax {version('jax')}, brax {version('brax')}"
    walking = Walking(args.seconds, about, f"crawl, preset {name}, {note}")
    carry = session.start()
    for _ in range(ITERATIONS):
        carry, report = session.advance(carry)
        found = means(session.names, report.fetch_sums()[0])
        falls = found["episode/failed"] / args.worlds
        if walking.over(train.ppo.unroll_length, found["task_speed_mps"], falls):
            return


if __name__ == "__main__":
    main()
