"""S5 over-current, S8 joint limits and tracking error."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fingers_robot.reading import JOINT_COUNT, Array
from fingers_robot.safety.limits import Limits, outside
from fingers_robot.safety.types import Found, Inputs


def _never() -> Array:
    return np.full(JOINT_COUNT, np.inf)


@dataclass(frozen=True, slots=True)
class JointMemory:
    """Since when each condition has held without a break [s]; infinite: it does not.

    Attributes:
        over_s: effort above the over-current threshold, [20].
        stall_s: effort above the stall threshold, [20].
        track_s: tracking error above the threshold, [20].
    """

    over_s: Array = field(default_factory=_never)
    stall_s: Array = field(default_factory=_never)
    track_s: Array = field(default_factory=_never)


def detect_joints(
    memory: JointMemory, inputs: Inputs, target_rad: Array, t: float, limits: Limits
) -> tuple[JointMemory, Found]:
    """Looks at every joint; arguments as `detect_sensors`.

    A value that is not finite satisfies no condition here: S3 reports it.
    """
    reading = inputs.reading
    if reading is None:
        return memory, {}
    found: Found = {}
    effort = np.abs(reading.effort_a) / limits.effort_limit_a
    error = np.abs(target_rad - reading.pos_rad)
    memory = JointMemory(
        over_s=_since(memory.over_s, effort > limits.over_effort, t),
        stall_s=_since(memory.stall_s, effort > limits.stall_effort, t),
        track_s=_since(memory.track_s, error > limits.tracking_rad, t),
    )
    _lasting(found, "S5", "stalled", memory.stall_s, t, limits.stall_s)
    _lasting(found, "S5", "over-current", memory.over_s, t, limits.over_effort_s)
    _lasting(found, "S8b", "not following", memory.track_s, t, limits.tracking_s)
    beyond = outside(reading.pos_rad, limits.factory_rad)
    worst = int(beyond.argmax())
    if beyond[worst] > limits.joint_margin_rad:
        found["S8"] = f"joint {worst} {beyond[worst]:.3f} rad outside its limits"
    return memory, found


def believable(pos_rad: Array, limits: Limits) -> NDArray[np.bool_]:
    """Which joint angles may be held: those that S8 does not report; not NaN, [20]."""
    return outside(pos_rad, limits.factory_rad) <= limits.joint_margin_rad


def _since(since: Array, holds: NDArray[np.bool_], t: float) -> Array:
    return np.where(holds, np.minimum(since, t), np.inf)


def _lasting(
    found: Found, row: str, words: str, since: Array, t: float, limit: float
) -> None:
    first = since.min()
    if t - first >= limit:
        found[row] = f"joint {int(since.argmin())} {words} for {t - first:.3f} s"
