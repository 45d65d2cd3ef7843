"""Forward kinematics of the finger that presses keys: encoders to its tip in V.

The numbers are the vendor's, of the WUJI right hand's middle finger (description
release 2026.04.27): pose of each link in its parent, joints about the link's y axis.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingers_deploy.rotations import Vector, conjugate, multiply, unrotate

Array = NDArray[np.float64]

FIRST_JOINT = 8
"""Place of the finger's first joint among the 20; four follow one another."""

_LINKS: tuple[tuple[Vector, Vector], ...] = (
    (
        (-0.01046, 0.0074615, 0.089544),
        (0.99904819, -1.2684802e-05, -0.043619208, 0.00029054705),
    ),
    ((0.0022, 0.0, 0.00400001), (0.70710678, 0.0, 0.0, 0.70710678)),
    ((0.0, 0.00475, 0.0436177), (0.70701177, 0.0, 0.0, -0.70720177)),
    ((0.0, -0.0002, 0.0295), (1.0, 0.0, 0.0, 0.0)),
)
_TIP: Vector = (-0.00105, 0.0002, 0.0215)


def pressing_fingertip(joint_pos: ArrayLike, v_quat_b: ArrayLike) -> Array:
    """Centre of the pressing fingertip relative to the palm's origin, in V [m], [3].

    p = q_V* (p₁ + R₁(p₂ + R₂(… + R₄ tip))), with R_i the link's pose and joint angle.
    Training uses the same formula (`envs.tasks.keyboard.stance`).

    Args:
        joint_pos: measured joint angles [rad], [20].
        v_quat_b: orientation of V in the palm frame, w x y z, from the manifest, [4].

    Source:
        Vendor's description of the WUJI hand, release 2026.04.27.
    """
    angles = np.asarray(joint_pos, np.float64)[FIRST_JOINT : FIRST_JOINT + len(_LINKS)]
    place: Array = np.asarray(_TIP, np.float64)
    for (pos, quat), angle in zip(reversed(_LINKS), reversed(angles), strict=True):
        about_y = (math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0)
        turned = unrotate(conjugate(multiply(quat, about_y)), place)
        place = np.asarray(pos, np.float64) + turned
    return unrotate(np.asarray(v_quat_b, np.float64), place)
