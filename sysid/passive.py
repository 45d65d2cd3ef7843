"""What an MJCF file says of joints beside masses: taken over, or refused by name."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from envs.errors import InputError
from envs.physics.quiet_mujoco import mujoco
from sysid.drive import JointDrive, Nominal


def with_passive(
    model: Any, joint: str, drive: JointDrive, source: object
) -> JointDrive:
    """Returns the drive of a joint with what the MJCF file has of it.

    `damping` becomes `viscous_friction`, `frictionloss` becomes `coulomb_friction`, and
    the force range of an actuator `torque_limit`.

    Args:
        model: the compiled file.
        joint: name of the joint.
        drive: as `drive.yaml` has it.
        source: for messages.

    Raises:
        InputError: a spring, gravity compensation, a constraint or a tendon, which the
            simulation of a joint does not have; or another figure than in `drive.yaml`.
    """
    _refuse_couplings(model, source)
    where, found = f"joint {joint}", model.joint(joint)
    if found.stiffness[0] != 0.0:
        valid = "0: springs of an MJCF file are not simulated"
        raise InputError(source, f"{where}, stiffness", found.stiffness[0], valid)
    dof = int(found.dofadr[0])
    _check_gains(model, joint, drive, source)
    figures = {
        "viscous_friction": ("damping_nms", float(model.dof_damping[dof])),
        "coulomb_friction": ("torque_nm", float(model.dof_frictionloss[dof])),
        "torque_limit": ("limit_nm", _force_limit(model, joint)),
    }
    effects = dict(drive.effects)
    for effect, (name, value) in figures.items():
        if value and effect not in effects:
            effects[effect] = {name: Nominal(value)}
        elif value and not _agrees(value, effects[effect][name]):
            given = f"{value:g} here, {effects[effect][name].value:g} in drive.yaml"
            raise InputError(source, f"{where}, {effect}", given, "the same in both")
    return replace(drive, effects=effects)


def _agrees(value: float, known: Nominal) -> bool:
    return known.free or abs(value - known.value) <= known.tolerance * abs(known.value)


def _refuse_couplings(model: Any, source: object) -> None:
    """Refuses what acts between bodies."""
    valid = "none: it is not simulated joint by joint"
    if model.neq:
        raise InputError(source, "equality", f"{model.neq} constraints", valid)
    strung = (model.tendon_stiffness, model.tendon_damping, model.tendon_frictionloss)
    if any(x.any() for x in strung):
        raise InputError(source, "tendon", "a spring, damper or friction", valid)
    if model.body_gravcomp.any():
        raise InputError(source, "gravcomp", model.body_gravcomp.max(), "0")


def _actuators(model: Any, joint: str) -> list[int]:
    """Numbers of the actuators of a joint."""
    at = int(mujoco.mjtTrn.mjTRN_JOINT)
    number = model.joint(joint).id
    return [
        i
        for i in range(model.nu)
        if model.actuator_trntype[i] == at and model.actuator_trnid[i, 0] == number
    ]


def actuator_gains(model: Any, joint: str) -> list[tuple[str, float, float]]:
    """Returns name, kp [N·m/rad] and kd [N·m·s/rad] of a joint's position actuators."""
    found = []
    for i in _actuators(model, joint):
        square = float(model.actuator_gear[i, 0]) ** 2
        kp, kd = (float(-model.actuator_biasprm[i, k]) * square for k in (1, 2))
        if kp > 0.0:
            found.append((model.actuator(i).name, kp, kd))
    return found


def _check_gains(model: Any, joint: str, drive: JointDrive, source: object) -> None:
    """Refuses position actuators that contradict the gains of the drive."""
    for actuator, kp, kd in actuator_gains(model, joint):
        for name, value in {"kp": kp, "kd": kd}.items():
            known: Nominal = getattr(drive, name)
            if value and not _agrees(value, known):
                given = f"{value:g} here, {known.value:g} in drive.yaml"
                where = f"actuator {actuator}, {name}"
                raise InputError(source, where, given, "the same in both")


def _force_limit(model: Any, joint: str) -> float:
    """Largest force of the actuators of a joint; 0 where none is limited."""
    limits: Mapping[int, float] = {
        i: float(model.actuator_forcerange[i, 1] * abs(model.actuator_gear[i, 0]))
        for i in _actuators(model, joint)
        if model.actuator_forcelimited[i]
    }
    return max(limits.values(), default=0.0)
