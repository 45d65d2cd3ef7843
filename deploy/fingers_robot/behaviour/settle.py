"""Settling after a recovery: from where the policy left the targets to the stance."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fingers_deploy.manifest import Interface
from fingers_robot.reading import Array
from fingers_robot.safety.motion import ramp_duration, smooth_ramp

SETTLE_S = 1.5
SPEED_SHARE = 0.8
"""Share of the fastest motion of a policy that the ramp may take."""


@dataclass(frozen=True, slots=True)
class Ramp:
    """A smooth ramp of the joint targets.

    Attributes:
        start_s: monotonic time at which it begins [s].
        start_rad: first targets, [20].
        goal_rad: last targets, [20].
        duration_s: from first to last [s].
    """

    start_s: float
    start_rad: Array
    goal_rad: Array
    duration_s: float

    def target(self, t: float) -> Array:
        """Returns the targets at time `t` [rad], [20]; after the end, the last ones."""
        return smooth_ramp(
            self.start_rad, self.goal_rad, t - self.start_s, self.duration_s
        )

    def over(self, t: float) -> bool:
        """Whether the last targets have been reached."""
        return t - self.start_s >= self.duration_s


def settle_ramp(
    t: float, target: ArrayLike, goal: ArrayLike, interface: Interface
) -> Ramp:
    """Returns a ramp over 1.5 s, longer where a joint has far to go.

    No joint is asked to move faster than 0.8 of what a policy of `interface` may ask.

    Args:
        t: monotonic time [s].
        target: targets on the wire [rad], [20].
        goal: targets that hold the stance [rad], [20].
        interface: of a policy, for α and the control rate.
    """
    start, end = np.asarray(target, np.float64), np.asarray(goal, np.float64)
    speed = SPEED_SHARE * interface.action.scale_rad * interface.control_rate_hz
    return Ramp(t, start, end, ramp_duration(start, end, SETTLE_S, speed))
