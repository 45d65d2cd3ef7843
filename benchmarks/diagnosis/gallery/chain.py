"""Nominal mechanisms of public records that are given by numbers: joints in a row."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from envs.physics.quiet_mujoco import mujoco


@dataclass(frozen=True, eq=False)
class Link:
    """A joint with the link that it turns; vectors are in the frame of the joint.

    Attributes:
        place: frame of the joint, at angle 0, in the frame of the joint before it.
        mass: of the link [kg].
        com: centre of mass [m].
        inertia: about the centre of mass [kg·m²].
        axis: of the joint.
        armature: rotor's inertia at the joint [kg·m²].
    """

    place: Float[np.ndarray, "4 4"]
    mass: float
    com: Float[np.ndarray, "3"]
    inertia: Float[np.ndarray, "3 3"]
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    armature: float = 0.0


def chain_model(links: Mapping[str, Link]) -> Any:
    """Compiles joints of which each carries the next.

    Args:
        links: by the name of their joint, from the base on.
    """
    spec = mujoco.MjSpec()
    # Identified inertias need not be those of a body.
    spec.compiler.balanceinertia = True
    body = spec.worldbody
    for name, link in links.items():
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, link.place[:3, :3].ravel())
        body = body.add_body(
            pos=link.place[:3, 3],
            quat=quat,
            mass=link.mass,
            ipos=link.com,
            fullinertia=link.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]],
            explicitinertial=True,
        )
        body.add_joint(name=name, axis=link.axis, armature=link.armature)
    return spec.compile()


def symmetric(values: Float[np.ndarray, "6"]) -> Float[np.ndarray, "3 3"]:
    """I = Iᵀ of the upper triangle Ixx, Ixy, Ixz, Iyy, Iyz, Izz.

    Args:
        values: of the triangle, row by row [kg·m²].

    Returns:
        The matrix [kg·m²].

    Source:
        An inertia is symmetric.
    """
    upper = np.zeros((3, 3))
    upper[np.triu_indices(3)] = values
    return upper + np.triu(upper, 1).T


def shifted(
    along: tuple[float, float, float], roll: float = 0.0
) -> Float[np.ndarray, "4 4"]:
    """T = Trans(d) Rot_x(α), a frame in the one before it.

    Args:
        along: d [m].
        roll: α [rad].

    Returns:
        The homogeneous transform, whose last column is in metres [1].

    Source:
        J. Craig, Introduction to Robotics, 3rd ed., 2005, chapter 2.
    """
    sin, cos = np.sin(roll), np.cos(roll)
    place = np.eye(4)
    place[1:3, 1:3] = [[cos, -sin], [sin, cos]]
    place[:3, 3] = along
    return place
