"""What a policy makes of fixed commands: achieved against commanded velocities."""

import math
from typing import Any

import numpy as np

from fingers_mjx.evaluation.evaluate import EpisodeTable, Progress
from fingers_mjx.evaluation.files import by_kind
from fingers_mjx.evaluation.steering.worlds import (
    BEGIN_S,
    Commanded,
    Course,
    driven,
    worlds_of,
)
from fingers_mjx.policy.source import PolicySource

Command = tuple[float, float, float]

COMMANDS: tuple[Command, ...] = (
    (0.16, 0.0, 0.0),
    (0.08, 0.0, 0.0),
    (0.0, 0.12, 0.0),
    (0.0, -0.12, 0.0),
    (0.1, 0.1, 0.0),
    (0.1, -0.1, 0.0),
    *((vel_x, 0.0, rate) for vel_x in (0.1, 0.0) for rate in (0.45, 0.2, -0.2, -0.45)),
    (0.0, 0.0, 0.0),
)
"""v_x, v_y [m/s] and yaw rate [rad/s] in V: straight, turning, on the spot, at rest."""


def obeyed(
    source: PolicySource, course: Course, progress: Progress | None = None
) -> list[dict[str, Any]]:
    """Measures what a policy makes of each of `COMMANDS`.

    Args:
        source: policy; its setup is what is simulated.
        course: episodes, seed, backend and length.
        progress: called with (steps done, steps in all).

    Returns:
        For each command: the command, and by name the summaries of turn rate, v_x, v_y,
        path speed and survival; means over an episode from `BEGIN_S` on.

    Raises:
        InputError: a task without commands.
    """
    commands = np.repeat(np.array(COMMANDS), course.episodes, axis=0)
    env = worlds_of(source, course, len(COMMANDS))
    table = driven(Commanded(env, commands), source, course, progress)
    found = [_means(table, number) for number in range(len(commands))]
    measures = by_kind(found, course.episodes, course.seed)
    return [
        {"command": list(command), **measured}
        for command, measured in zip(COMMANDS, measures, strict=True)
    ]


def _means(table: EpisodeTable, number: int) -> dict[str, float]:
    """Returns means of one episode; NaN where it ended before it was under way."""
    from_ = round(BEGIN_S / table.dt_s)
    trace, speed = table.episode(number), table.columns["path_speed_mps"][number]
    yaw, vel = trace.yaw_rate[from_:], trace.vel_v[from_:]
    if not len(yaw):
        yaw, vel = np.full(1, math.nan), np.full((1, 2), math.nan)
    return {
        "turn_rate_rad_s": float(yaw.mean()),
        "vel_x_mps": float(vel[:, 0].mean()),
        "vel_y_mps": float(vel[:, 1].mean()),
        "path_speed_mps": float(speed),
        "survival": float(table.columns["survival"][number]),
    }
