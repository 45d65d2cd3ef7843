"""S2, finger by finger: some of them freeze while the others go on.

Versions of the vendor's library have done so: angles of a finger stand still in the
cache of the fast path, bit by bit, while the finger moves.
"""

import dataclasses
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fingers_robot.reading import JOINT_COUNT, Array
from fingers_robot.safety.limits import Limits

FINGERS = 5
_SHAPE = (FINGERS, JOINT_COUNT // FINGERS)


@dataclass(frozen=True, slots=True)
class FingerMemory:
    """When each finger's angles last changed.

    Attributes:
        pos_rad: newest angles, [5, 4]; NaN before the first sample.
        since_s: time of the last change of each finger [s], [5].
        target_rad: targets at that time, [5, 4].
        frozen: found frozen, and not changed since, [5].
    """

    pos_rad: Array = field(default_factory=lambda: np.full(_SHAPE, np.nan))
    since_s: Array = field(default_factory=lambda: np.full(FINGERS, np.inf))
    target_rad: Array = field(default_factory=lambda: np.zeros(_SHAPE))
    frozen: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(FINGERS, bool))


def detect_fingers(
    memory: FingerMemory, pos_rad: Array | None, target_rad: Array, t: float, c: Limits
) -> tuple[FingerMemory, str]:
    """Looks for fingers whose angles stand still while their own targets move.

    Args:
        memory: memory after the step before.
        pos_rad: newest measured angles, [20]; None before the first sample.
        target_rad: targets on the wire, [20].
        t: monotonic time [s].
        c: the limits.

    Returns:
        The memory, and what was found in words (empty if nothing).
    """
    if pos_rad is None:
        return memory, ""
    pos, target = pos_rad.reshape(_SHAPE), target_rad.reshape(_SHAPE)
    changed = (pos != memory.pos_rad).any(axis=1)
    since = np.where(changed, t, memory.since_s)
    begun = np.where(changed[:, None], target, memory.target_rad)
    moved = np.abs(target - begun).max(axis=1) > c.frozen_finger_rad
    stands = ~changed & (t - since >= c.frozen_joints_s)
    frozen = stands & (moved | memory.frozen)
    memory = dataclasses.replace(
        memory, pos_rad=pos, since_s=since, target_rad=begun, frozen=frozen
    )
    if not frozen.any():
        return memory, ""
    finger = int(frozen.argmax())
    age_ms = 1e3 * (t - since[finger])
    return memory, f"finger {finger + 1} frozen for {age_ms:.0f} ms while it moves"
