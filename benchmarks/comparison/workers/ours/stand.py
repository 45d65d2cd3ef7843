"""This project's crawl, trained with a preset until its hands stand."""

import dataclasses
from importlib.metadata import version

from benchmarks.comparison.workers.report import STANDING_STEPS, arguments, say
from envs.rounding import fix_rounding
from fingers_mjx.ppo.config import preset
from fingers_mjx.ppo.totals import means
from fingers_mjx.runs.setup import make_env, new_setup
from fingers_mjx.training.session import Session


def main() -> None:
    """Trains until episodes that end are long, and says so."""
    fix_rounding()
    args = arguments()
    name = "cpu" if args.device == "cpu" else "fast"
    chosen = preset(name, "crawl")
    own = {"num_envs": args.worlds, "seed": args.seed, "backend": args.backend}
    train = dataclasses.replace(chosen, **own)
    setup = dataclasses.replace(new_setup(train, None), train=train)
    session = Session(make_env(setup, args.worlds, args.backend), [setup])
    carry, length = session.start(), 0.0
    for _ in range(train.iterations):
        carry, report = session.advance(carry)
        found = means(session.names, report.fetch_sums()[0])
        length = found.get("episode/length", 0.0)
        if length >= STANDING_STEPS:
            about = f"jax {version('jax')}, brax {version('brax')}"
            say(first=True, version=about, note=f"crawl, preset {name}")
            return
    raise SystemExit(f"RuntimeError: episodes last {length:.0f} steps at the end")


if __name__ == "__main__":
    main()
