"""Nominal mechanisms of public records: URDF files without meshes, and pendulums."""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from envs.physics.quiet_mujoco import mujoco
from sysid.drive import JointDrive, Nominal

DRIVEN = JointDrive(Nominal(1.0), Nominal(1.0), known="mechanics")
"""A joint whose logged torque drives it; how its servo comes to it is not known."""

_OPTIONS = {
    "strippath": "true",
    "discardvisual": "true",
    "fusestatic": "false",
    "balanceinertia": "true",
    "boundmass": "1e-6",
    "boundinertia": "1e-9",
}


def urdf_model(text: bytes, payload: str = "") -> Any:
    """Compiles the masses, axes and inertias of a URDF file.

    Meshes, friction and limits of the file are left out: what a joint's friction is,
    the record is to show.

    Args:
        text: of the file.
        payload: name of the link that carries a load, "" for the last one.
    """
    robot = ET.fromstring(text)
    for link in robot.iter("link"):
        for part in (*link.findall("visual"), *link.findall("collision")):
            link.remove(part)
        if payload and link.get("name") == payload:
            link.set("name", "payload")
    for joint in robot.iter("joint"):
        for part in (*joint.findall("dynamics"), *joint.findall("limit")):
            joint.remove(part)
        if joint.get("type") == "revolute":
            joint.set("type", "continuous")
        for end in (*joint.findall("parent"), *joint.findall("child")):
            if payload and end.get("link") == payload:
                end.set("link", "payload")
    for part in (*robot.findall("transmission"), *robot.findall("gazebo")):
        robot.remove(part)
    options = ET.SubElement(robot, "mujoco")
    ET.SubElement(options, "compiler", _OPTIONS)
    return mujoco.MjModel.from_xml_string(ET.tostring(robot, encoding="unicode"))


def driven_columns(
    joints: Sequence[str],
    angles: Sequence[Float[np.ndarray, " n"]] | Float[np.ndarray, "j n"],
    efforts: Sequence[Float[np.ndarray, " n"]] | Float[np.ndarray, "j n"],
    quantity: str = "tau",
) -> dict[str, Float[np.ndarray, " n"]]:
    """Columns of joints that an effort drives: their targets are their angles.

    Args:
        joints: their names.
        angles: of each that were measured [rad].
        efforts: of each one's drive, in the unit of their quantity.
        quantity: of the efforts.
    """
    columns = {}
    for joint, angle, effort in zip(joints, angles, efforts, strict=True):
        columns |= {f"cmd.{joint}": angle, f"pos.{joint}": angle}
        columns[f"{quantity}.{joint}"] = effort
    return columns


def pendulum_model(name: str, parts: dict[float, float], armature: float = 0.0) -> Any:
    """A pendulum that hangs at 0.

    Args:
        name: of its joint.
        parts: masses [kg] by their distance from the axis [m].
        armature: rotor's inertia at the joint [kg·m²].
    """
    bodies = "".join(
        f'<body><inertial pos="0 0 {-arm}" mass="{mass}" '
        'diaginertia="1e-6 1e-6 1e-6"/></body>'
        for arm, mass in parts.items()
    )
    return mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body>"
        f'<joint name="{name}" axis="0 1 0" armature="{armature}"/>'
        '<inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/>'
        f"{bodies}</body></worldbody></mujoco>"
    )
