"""How the robot's heading controller holds and changes a heading in simulation."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from fingers_deploy import rotations
from fingers_mjx.evaluation.evaluate import EpisodeTable, Progress
from fingers_mjx.evaluation.files import by_kind
from fingers_mjx.evaluation.steering.worlds import (
    Course,
    Holding,
    driven,
    worlds_of,
)
from fingers_mjx.policy.source import PolicySource
from fingers_robot.behaviour.heading import HeadingConfig, heading

STEPS_DEG = (0.0, 15.0, -15.0, 30.0, -30.0)
"""Changes of the heading that are held; 0 shows the drift."""
WALK = (0.1, 0.0, 0.0)
"""Command under which a heading is held."""
WITHIN_DEG = 3.0
"""A heading is reached while its mean over a second is so near."""
SETTLED_S = 5.0
"""Time in which a heading should be reached, for good."""


def held(
    source: PolicySource,
    course: Course,
    gains: HeadingConfig,
    progress: Progress | None = None,
) -> list[dict[str, Any]]:
    """Measures how the controller comes to a heading and keeps it, under `WALK`.

    Args:
        source: policy; its setup is what is simulated.
        course: episodes, seed, backend and length.
        gains: of the controller.
        progress: called with (steps done, steps in all).

    Returns:
        For each of `STEPS_DEG`: the step, and by name the summaries of the error in the
        last second [°], the drift over the second half [°/s], the time to settle [s],
        the share that settled within `SETTLED_S`, and survival.

    Raises:
        InputError: a task without commands.
    """
    steps_rad = np.repeat(np.deg2rad(STEPS_DEG), course.episodes)
    env = worlds_of(source, course, len(STEPS_DEG))
    commands = np.tile(np.array(WALK), (len(steps_rad), 1))
    worlds = Holding(env, commands, steps_rad, gains)
    table = driven(worlds, source, course, progress)
    found = [
        _kept(table, number, step_rad, env.stance.q_off)
        for number, step_rad in enumerate(steps_rad)
    ]
    measures = by_kind(found, course.episodes, course.seed)
    return [
        {"step_deg": step_deg, **measured}
        for step_deg, measured in zip(STEPS_DEG, measures, strict=True)
    ]


def _kept(
    table: EpisodeTable, number: int, step_rad: float, q_off: Sequence[float]
) -> dict[str, float]:
    """Returns how one episode came to its heading and kept it; NaN if it was short."""
    trace, second = table.episode(number), round(1.0 / table.dt_s)
    quats_w = (rotations.multiply(quat_w, q_off) for quat_w in trace.palm_quat_w)
    turned = np.unwrap([heading(quat_w) for quat_w in quats_w])
    error_deg = np.rad2deg(turned - turned[:1] - step_rad)
    mean_deg = np.convolve(error_deg, np.ones(second) / second, "valid")
    survived = float(table.columns["survival"][number])
    if not survived:
        mean_deg = np.full(2, math.nan)
    half, length_s = len(mean_deg) // 2, len(mean_deg) * table.dt_s
    outside = np.flatnonzero(np.abs(mean_deg) > WITHIN_DEG)
    settled_s = ((outside[-1] + 1) if len(outside) else 0) * table.dt_s + 1.0
    reached = survived and settled_s < length_s
    return {
        "error_deg": float(abs(mean_deg[-1])),
        "drift_deg_s": float((mean_deg[-1] - mean_deg[half]) / (length_s / 2)),
        "settled_s": float(settled_s) if reached else math.nan,
        "settled": float(reached and settled_s <= SETTLED_S),
        "survival": survived,
    }
