"""Stiffness, damping and armature from one log: this project's fit and mujoco.sysid.

Both run in one process on the same logs, see `benchmarks.diagnosis.identify`. Its logs
come from C MuJoCo, which is also the simulator inside mujoco.sysid.
"""

import logging
from importlib.metadata import version

import numpy as np

from benchmarks.comparison.workers.report import arguments, say
from benchmarks.diagnosis.identify import NAMES, NOMINAL, ours, recorded, theirs, timed

LOGS, SECONDS = 3, 30.0


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
    say(done=True)


def _version() -> str:
    return f"mujoco {version('mujoco')}, jax {version('jax')}"


if __name__ == "__main__":
    main()
