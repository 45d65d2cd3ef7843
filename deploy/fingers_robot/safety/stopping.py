"""Stopping: hold the measured pose, or settle into the rest pose and let go."""

from dataclasses import dataclass, replace

import numpy as np

from fingers_robot.reading import Array
from fingers_robot.safety.limits import Limits
from fingers_robot.safety.motion import smooth_ramp, toward
from fingers_robot.safety.types import Reaction

_LONGEST = 2.0  # multiple of the settle time after which it is over in any case


@dataclass(frozen=True, slots=True)
class Stop:
    """Where stopping stands.

    Attributes:
        hold_rad: the measured pose that is held, [20].
        t_s: time of the step before [s].
        settle_s: when the settle ramp began [s]; None while holding.
        from_rad: targets at that time, [20].
    """

    hold_rad: Array
    t_s: float
    settle_s: float | None = None
    from_rad: Array | None = None


def start_stop(pose_rad: Array, t: float) -> Stop:
    """Begins with holding `pose_rad`, the last valid measured pose, [20]."""
    return Stop(pose_rad, t)


def step_stop(
    stop: Stop, target_rad: Array, reaction: Reaction, t: float, limits: Limits
) -> tuple[Stop, Array, bool]:
    """Advances stopping by one step.

    Targets move at most as fast as the policy may move them, α per control step.

    Args:
        stop: the state.
        target_rad: targets on the wire, [20].
        reaction: what the latched faults call for.
        t: monotonic time [s].
        limits: the limits.

    Returns:
        The new state, the new targets, and whether the settle ramp is over.
    """
    rate = limits.step_rad / limits.control_dt_s
    reach = rate * min(max(t - stop.t_s, 0.0), limits.control_dt_s)
    stop = replace(stop, t_s=t)
    if reaction >= Reaction.SETTLE and stop.settle_s is None:
        stop = replace(stop, settle_s=t, from_rad=target_rad)
    if stop.settle_s is None or stop.from_rad is None:
        return stop, toward(target_rad, stop.hold_rad, reach), False
    elapsed = t - stop.settle_s
    goal = smooth_ramp(stop.from_rad, limits.rest_rad, elapsed, limits.settle_s)
    target = toward(target_rad, goal, reach)
    arrived = elapsed >= limits.settle_s and bool(
        np.abs(target - limits.rest_rad).max() < 1e-6
    )
    return stop, target, arrived or elapsed >= _LONGEST * limits.settle_s
