"""Springs, damping, friction and limits of joints in an MJCF file, and its options."""

import math
from dataclasses import replace
from typing import Any

from envs.errors import InputError
from envs.physics.quiet_mujoco import mujoco
from sysid.drive import JointDrive, Nominal
from sysid.mjcf.actuators import (
    actuator_gains,
    check_actuators,
    force_limit,
    refuse_nonzero,
)

_OPTIONS = {
    "density": "density",
    "viscosity": "viscosity",
    "wind": "wind",
    "actuatorgroupdisable": "disableactuator",
}
"""Options that act on joints, by the name of their field."""

_FLAGS = ("constraint", "frictionloss", "damper", "gravity", "clampctrl", "actuation")
"""Those that would switch off what is taken over from the file."""

_TENDON = (
    *("stiffness", "stiffnesspoly", "damping", "dampingpoly"),
    *("frictionloss", "armature", "limited"),
)
"""What makes a tendon act on joints."""


def with_passive(
    model: Any, joint: str, drive: JointDrive, source: object
) -> JointDrive:
    """Returns the drive of a joint with what the MJCF file has of it.

    `damping` becomes `viscous_friction`, `frictionloss` becomes `coulomb_friction`, and
    the limits of the joint's actuators `torque_limit`.

    Args:
        model: the compiled file.
        joint: name of the joint.
        drive: as `drive.yaml` has it.
        source: for messages.

    Raises:
        InputError: something that acts on joints and is not simulated, as a spring, a
            tendon, a fluid or an actuator of another kind; or another figure than in
            `drive.yaml`.
    """
    _refuse_couplings(model, source)
    where, found = f"joint {joint}", model.joint(joint)
    dof = int(found.dofadr[0])
    springs = {
        "stiffness": found.stiffness,
        "stiffness, higher orders": model.jnt_stiffnesspoly[found.id],
        "damping, higher orders": model.dof_dampingpoly[dof],
    }
    valid = "0: springs and damping by the square of speed are not simulated"
    refuse_nonzero(source, f"{where}, ", springs, valid)
    check_actuators(model, joint, source)
    _check_gains(model, joint, drive, source)
    limit = force_limit(model, joint, source)
    figures = {
        "viscous_friction": ("damping_nms", float(model.dof_damping[dof])),
        "coulomb_friction": ("torque_nm", float(model.dof_frictionloss[dof])),
        "torque_limit": ("limit_nm", limit if math.isfinite(limit) else 0.0),
    }
    effects = dict(drive.effects)
    for effect, (name, value) in figures.items():
        given = effects.get(effect, {})
        if value and name not in given:
            effects[effect] = {name: Nominal(value)}
        elif value and not _agrees(value, given[name]):
            both = f"{value:g} here, {given[name].value:g} in drive.yaml"
            raise InputError(source, f"{where}, {effect}", both, "the same in both")
    return replace(drive, effects=effects)


def _agrees(value: float, known: Nominal) -> bool:
    return known.free or abs(value - known.value) <= known.tolerance * abs(known.value)


def _refuse_couplings(model: Any, source: object) -> None:
    """Refuses what acts between bodies, from outside, or switches figures off."""
    valid = "none: it is not simulated joint by joint"
    parts = {"equality": model.neq, "flex": model.nflex, "plugin": model.nplugin}
    refuse_nonzero(source, "", parts, valid)
    options = {name: getattr(model.opt, field) for name, field in _OPTIONS.items()}
    refuse_nonzero(source, "option ", options, "0: it is not simulated")
    for i in range(model.ntendon):
        acts = {name: getattr(model, f"tendon_{name}")[i] for name in _TENDON}
        name = model.tendon(i).name or f"number {i}"
        refuse_nonzero(source, f"tendon {name}, ", acts, valid)
    for i in range(model.nbody):
        name = model.body(i).name or f"number {i}"
        lift = {"gravcomp": model.body_gravcomp[i]}
        refuse_nonzero(source, f"body {name}, ", lift, "0: it is not simulated")
    for name in _FLAGS:
        bit = int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{name.upper()}"))
        if model.opt.disableflags & bit:
            valid = "enable: what the file says of it is simulated"
            raise InputError(source, f"flag {name}", "disable", valid)


def _check_gains(model: Any, joint: str, drive: JointDrive, source: object) -> None:
    """Refuses a position servo that contradicts the gains of the drive."""
    for actuator, kp, kd in actuator_gains(model, joint):
        for name, value in {"kp": kp, "kd": kd}.items():
            known: Nominal = getattr(drive, name)
            if value and not _agrees(value, known):
                given = f"{value:g} here, {known.value:g} in drive.yaml"
                where = f"actuator {actuator}, {name}"
                raise InputError(source, where, given, "the same in both")
