"""From samples of an overhead camera to the pushing policy's inputs.

Training uses the same formulas on simulated samples (`envs.tasks.push.tracking`).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingers_deploy.rotations import unrotate

Array = NDArray[np.float64]

VELOCITY_TIME_S = 0.15
"""Time constant τ of the velocity estimate [s]."""


@dataclass(frozen=True)
class Frame:
    """One sample of the camera; world z is up.

    Attributes:
        t_s: time of the exposure [s].
        object_pos_w: centre of the object [m], [3].
        root_pos_w: origin of the palm [m], [3].
        heading_rad: angle of V's x axis about the vertical.
    """

    t_s: float
    object_pos_w: ArrayLike
    root_pos_w: ArrayLike
    heading_rad: float


class ObjectTracker:
    """Tracks one object through one trial.

    Args:
        target_pos_w: where the object is to go, fixed in the world [m], [3].
        v_quat_b: orientation of V in the palm frame, from the manifest.
    """

    def __init__(self, target_pos_w: ArrayLike, v_quat_b: ArrayLike):
        self._target = np.asarray(target_pos_w, np.float64)
        self._v_quat_b = np.asarray(v_quat_b, np.float64)
        self._frame: Frame | None = None
        self._slow: Array = np.zeros(3)

    def aim(self, target_pos_w: ArrayLike) -> None:
        """Sets another target p* in the world.

        Args:
            target_pos_w: where the object is to go [m], [3].

        Source:
            Ours: fixed in the world, as in training (`docs/reference/push.md`).
        """
        self._target = np.asarray(target_pos_w, np.float64)

    def update(self, frame: Frame) -> None:
        """Takes in the newest sample; one that was seen before changes nothing.

        s ← s + (1 − e^{−Δt/τ}) (p − s), with the time Δt between exposures. The first
        sample is of an object at rest.
        """
        pos = np.asarray(frame.object_pos_w, np.float64)
        if self._frame is None:
            self._frame, self._slow = frame, pos
        elif (passed_s := frame.t_s - self._frame.t_s) > 0:
            share = 1.0 - math.exp(-passed_s / VELOCITY_TIME_S)
            self._frame, self._slow = frame, self._slow + share * (pos - self._slow)

    def inputs(self, gravity_b: ArrayLike) -> NDArray[np.float32]:
        """Returns object position [m], velocity [m/s], way to the target [m] in V, [9].

        (p − p_palm, (p − s)/τ, p* − p), with the low-pass s of `update`.

        Args:
            gravity_b: unit vector of gravity in the palm frame as the IMU measures it
                [1], [3].

        Raises:
            ValueError: before the first sample.

        Source:
            Ours: the inputs of training (`docs/reference/push.md`).
        """
        if self._frame is None:
            raise ValueError("tracker: found no camera sample; valid: one or more")
        frame = self._frame
        pos, root = (
            np.asarray(p, np.float64) for p in (frame.object_pos_w, frame.root_pos_w)
        )
        gravity_v = unrotate(self._v_quat_b, np.asarray(gravity_b, np.float64))
        vel = (pos - self._slow) / VELOCITY_TIME_S
        vectors = (pos - root, vel, self._target - pos)
        parts = [to_v(v, frame.heading_rad, gravity_v) for v in vectors]
        return np.concatenate(parts).astype(np.float32)


def to_v(vector_w: Array, heading_rad: float, gravity_v: Array) -> Array:
    """World components of a vector as components in V, [3].

    v = (c·x + s·y) e_ahead + (c·y − s·x) e_left + z·e_up, with cosine and sine of the
    heading: tilt from the IMU, heading from the camera.

    Args:
        vector_w: the vector (x, y, z), e.g. in [m], [3].
        heading_rad: angle about the vertical of V's x axis, seen from above [rad].
        gravity_v: unit vector of gravity in V [1], [3].

    Source:
        Ours (`docs/reference/push.md`, Camera).
    """
    up = -gravity_v
    ahead = np.array([1.0, 0.0, 0.0]) - up[0] * up
    ahead = ahead / np.linalg.norm(ahead)
    left = np.cross(up, ahead)
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    x, y, z = vector_w
    return (cos * x + sin * y) * ahead + (cos * y - sin * x) * left + z * up
