"""Unit quaternions w x y z, in plain floats: faster than arrays at this size."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector = Sequence[float] | Array


def multiply(a: Vector, b: Vector) -> Array:
    """Hamilton product c = a ⊗ b: first the rotation b, then a; [4].

    Args:
        a: quaternion w x y z [1], [4].
        b: quaternion w x y z [1], [4].

    Source:
        Solà, *Quaternion kinematics for the error-state Kalman filter*, 2017
        (Hamilton convention).
    """
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return np.array(
        (
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        )
    )


def unrotate(q: Vector, v: Vector) -> Array:
    """Turns world components of v into those of the frame q, v' = q* ⊗ v ⊗ q; [3].

    Args:
        q: orientation of the frame, unit quaternion w x y z [1], [4].
        v: a vector, e.g. in [m] or [m/s], [3].

    Source:
        Solà, *Quaternion kinematics for the error-state Kalman filter*, 2017
        (Hamilton convention).
    """
    w, x, y, z = q
    a, b, c = v
    # t = 2 (−u) × v with u the vector part; v + w t + (−u) × t
    tx, ty, tz = 2 * (z * b - y * c), 2 * (x * c - z * a), 2 * (y * a - x * b)
    return np.array(
        (
            a + w * tx + z * ty - y * tz,
            b + w * ty + x * tz - z * tx,
            c + w * tz + y * tx - x * ty,
        )
    )


def conjugate(q: Vector) -> Array:
    """The inverse rotation of a unit quaternion, q* = (w, −x, −y, −z); [4].

    Args:
        q: unit quaternion w x y z [1], [4].

    Source:
        Solà, *Quaternion kinematics for the error-state Kalman filter*, 2017
        (Hamilton convention).
    """
    w, x, y, z = q
    return np.array((w, -x, -y, -z))


def gravity(quat_w: Vector) -> Array:
    """Unit vector of gravity in a frame of this orientation, q* ⊗ (0, 0, −1) ⊗ q; [3].

    Args:
        quat_w: orientation in a level world frame, unit quaternion w x y z [1], [4].

    Source:
        Solà, *Quaternion kinematics for the error-state Kalman filter*, 2017
        (Hamilton convention).
    """
    w, x, y, z = quat_w
    return np.array(
        (2 * (w * y - x * z), -2 * (w * x + y * z), 2 * (x * x + y * y) - 1.0)
    )


def tilt(gravity_v: Vector) -> tuple[float, float]:
    """Roll and pitch of V against level [rad], from gravity in V.

    With the up direction u = −g in V: roll = atan2(u_y, u_z), pitch = asin(−u_x).
    """
    x, y, z = gravity_v
    return math.atan2(-y, -z), math.asin(max(-1.0, min(1.0, x)))
