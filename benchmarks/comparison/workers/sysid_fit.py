"""Stiffness, damping and armature from one log: this project's fit and mujoco.sysid.

A last log has dry friction, which the models of both lack at first.

Both run in one process on the same logs, see `benchmarks.diagnosis.identify`. Its logs
come from C MuJoCo, which is also the simulator inside mujoco.sysid.
"""

import logging
from functools import partial
from importlib.metadata import version

import numpy as np

from benchmarks.comparison.workers.report import arguments, say
from benchmarks.diagnosis.identify import NAMES, NOMINAL, ours, recorded, theirs, timed

LOGS, SECONDS = 3, 30.0
DRY_NM = 0.03
"""Dry friction of the log with an effect that the first models lack."""


def main() -> None:
    """Fits and reports the worst error and the time of each log of each tool."""
    args = arguments()
    logging.disable(logging.INFO)
    tools = {"fingers_mjx": ours, "mujoco.sysid": theirs}
    for seed in range(args.seed, args.seed + LOGS):
        rng = np.random.default_rng(seed)
        true = NOMINAL * np.exp(rng.uniform(-0.5, 0.5, len(NAMES)))
        log = recorded(true, rng, SECONDS)
        for tool, fit in tools.items():
            row = timed(fit, log, true)
            worst = 100.0 * max(row[name] for name in NAMES)
            about = {"peer": tool, "version": _version(), "note": f"log {seed}"}
            say(
                quantity="largest relative error of three",
                unit="%",
                value=worst,
                **about,
            )
            say(quantity="time of the fit", unit="s", value=row["seconds"], **about)
    _say_outside(args.seed)
    say(done=True)


def _say_outside(seed: int) -> None:
    """Fits a log with dry friction, and says what the three parameters become."""
    rng = np.random.default_rng(seed)
    true = NOMINAL * np.exp(rng.uniform(-0.5, 0.5, len(NAMES)))
    log = recorded(true, rng, SECONDS, DRY_NM)
    lacks = f"dry friction of {DRY_NM} N m in the log, none in the model"
    has = f"dry friction of {DRY_NM} N m in the log, fitted as a fourth parameter"
    fits = (
        ("fingers_mjx", ours, lacks),
        ("mujoco.sysid", theirs, lacks),
        ("fingers_mjx", partial(ours, with_friction=True), has),
    )
    for tool, fit, note in fits:
        row = timed(fit, log, true)
        worst = 100.0 * max(row[name] for name in NAMES)
        about = {"peer": tool, "version": _version(), "note": note}
        say(
            quantity="largest relative error of three, friction",
            unit="%",
            value=worst,
            **about,
        )


def _version() -> str:
    return f"mujoco {version('mujoco')}, jax {version('jax')}"


if __name__ == "__main__":
    main()
