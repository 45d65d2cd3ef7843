"""The supervisor's own targets: never a jump."""

import numpy as np
from numpy.typing import ArrayLike

from fingers_robot.reading import Array


def toward(target_rad: Array, goal_rad: Array, step_rad: float) -> Array:
    """Moves each target towards its goal by at most `step_rad`, [20]."""
    return target_rad + np.clip(goal_rad - target_rad, -step_rad, step_rad)


def smooth_ramp(
    start: ArrayLike, goal: ArrayLike, elapsed_s: float, duration_s: float
) -> Array:
    """Ramp: start + (goal − start)(3s² − 2s³), s = elapsed / duration in [0, 1].

    The speed is zero at both ends and at most 1.5 (goal − start) / duration.

    Args:
        start: first targets [rad].
        goal: last targets [rad].
        elapsed_s: time since the start [s].
        duration_s: duration of the ramp [s], above zero.
    """
    s = min(max(elapsed_s / duration_s, 0.0), 1.0)
    begin = np.asarray(start, np.float64)
    return begin + (np.asarray(goal, np.float64) - begin) * (s * s * (3.0 - 2.0 * s))


def ramp_duration(start: Array, goal: Array, shortest_s: float, speed: float) -> float:
    """Duration of a smooth ramp whose fastest joint stays below `speed` [rad/s]."""
    return max(shortest_s, 1.5 * float(np.abs(goal - start).max()) / speed)
