"""This project's crawl, trained with a preset for a given time."""

import dataclasses
from importlib.metadata import version

from benchmarks.comparison.workers.report import arguments
from benchmarks.comparison.workers.walking import ITERATIONS, Walking
from envs.rounding import fix_rounding
from fingers_mjx.ppo.config import preset
from fingers_mjx.ppo.totals import means
from fingers_mjx.runs.setup import make_env, new_setup
from fingers_mjx.training.session import Session


def main() -> None:
    """Trains until the time is over, and says how fast the hand walks."""
    fix_rounding()
    args = arguments()
    name = "cpu" if args.device == "cpu" else "fast"
    own = {"num_envs": args.worlds, "seed": args.seed, "backend": args.backend}
    train = dataclasses.replace(preset(name, "crawl"), **own)
    setup = dataclasses.replace(new_setup(train, None), train=train)
    session = Session(make_env(setup, args.worlds, args.backend), [setup])
    about = f"jax {version('jax')}, brax {version('brax')}"
    note = f"crawl, preset {name}, commands of training"
    walking, carry, length = Walking(args.seconds, about, note), session.start(), 0.0
    for _ in range(ITERATIONS):
        carry, report = session.advance(carry)
        found = means(session.names, report.fetch_sums()[0])
        length = found.get("episode/length", length)
        if walking.over(length, found["task_speed_mps"]):
            return


if __name__ == "__main__":
    main()
