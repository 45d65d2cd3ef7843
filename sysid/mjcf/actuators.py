"""Actuators of an MJCF file that move a joint: one position servo, or motors.

What of them is simulated is listed here, and everything else is refused by name.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from envs.errors import InputError
from envs.physics.quiet_mujoco import mujoco

_KINDS = {
    "trntype": (mujoco.mjtTrn, ("joint", "jointinparent")),
    "dyntype": (mujoco.mjtDyn, ("none",)),
    "gaintype": (mujoco.mjtGain, ("fixed",)),
    "biastype": (mujoco.mjtBias, ("none", "affine")),
}
"""Types of which motors and position servos are made; for a hinge or a slide the two
transmissions are one."""

_ABSENT = ("delay", "damping", "dampingpoly", "armature")
"""Figures of an actuator that are not simulated. Its `armature` is in the mass matrix,
but not in the rotor, whose tolerance is that of the joint's own `armature`."""

_ROUNDING = 1e-3
"""Share of a joint's range that a range of targets may lack, as 1.57 does of π/2."""


def check_actuators(model: Any, joint: str, source: object) -> None:
    """Refuses what moves a joint and is no position servo and no motor.

    A servo's `ctrlrange` has to hold the range of the joint. Where that has none, all
    targets are taken to lie within: which ones a log has is not known here.

    Args:
        model: the compiled file.
        joint: name of the joint.
        source: for messages.

    Raises:
        InputError: another kind of actuator, a servo beside another actuator, or a
            servo that cannot be sent through the range of the joint.
    """
    acting = _acting(model, joint)
    for i in acting:
        _check_kind(model, i, source)
    servos = [i for i in acting if _is_servo(model, i)]
    if servos and len(acting) > 1:
        found = ", ".join(_name(model, i) for i in acting)
        valid = "one position servo, or motors alone"
        raise InputError(source, f"joint {joint}, actuators", found, valid)
    for i in servos:
        _check_targets(model, i, joint, source)


def actuator_gains(model: Any, joint: str) -> list[tuple[str, float, float]]:
    """Returns name, kp [N·m/rad] and kd [N·m·s/rad] of a joint's position servos."""
    found = []
    for i in filter(lambda i: _is_servo(model, i), _acting(model, joint)):
        kp, kd = (float(-x) * _gear(model, i) ** 2 for x in _bias(model, i)[1:])
        found.append((_name(model, i), kp, kd))
    return found


def force_limit(model: Any, joint: str, source: object) -> float:
    """Largest effort of all actuators of a joint [N·m, or N]; inf where none is.

    That is the sum of what they give, and no more than the joint's `actuatorfrcrange`.

    Args:
        model: the compiled file.
        joint: name of the joint.
        source: for messages.

    Raises:
        InputError: a range whose ends are not opposite.
    """
    acting = _acting(model, joint)
    limit = sum(_most(model, i, source) for i in acting) if acting else math.inf
    number = model.joint(joint).id
    if model.jnt_actfrclimited[number]:
        where = f"joint {joint}, actuatorfrcrange"
        limit = min(limit, _end(model.jnt_actfrcrange[number], where, source))
    return limit


def refuse_nonzero(
    source: object, where: str, figures: Mapping[str, Any], valid: str
) -> None:
    """Refuses the first figure that is not 0.

    Args:
        source: for messages.
        where: whose figures they are.
        figures: numbers or arrays by name.
        valid: what would be.

    Raises:
        InputError: the first one, by name.
    """
    for name, value in figures.items():
        if np.any(value):
            found = " ".join(f"{x:g}" for x in np.ravel(value).astype(float))
            raise InputError(source, f"{where}{name}", found, valid)


def _acting(model: Any, joint: str) -> list[int]:
    """Numbers of the actuators that move a joint, through whatever they act.

    Whether one does is read off a posture away from the initial one, where a lever may
    be 0 by chance.
    """
    data = mujoco.MjData(model)
    mujoco.mj_integratePos(model, data.qpos, np.linspace(0.1, 0.2, model.nv), 1.0)
    for step in ("kinematics", "comPos", "tendon", "transmission"):
        getattr(mujoco, f"mj_{step}")(model, data)
    dof = int(model.joint(joint).dofadr[0])
    return [i for i in range(model.nactuator) if _moves(model, data, i, dof)]


def _moves(model: Any, data: Any, i: int, dof: int) -> bool:
    """Whether an actuator acts on a degree of freedom; on a body, it may on all."""
    if model.actuator_trntype[i] == int(mujoco.mjtTrn.mjTRN_BODY):
        return True
    first = model.actuator_outadr[i]
    for row in range(first, first + model.actuator_outnum[i]):
        at = data.moment_rowadr[row] + np.arange(data.moment_rownnz[row])
        lever = data.actuator_moment[at[data.moment_colind[at] == dof]]
        if np.any(np.abs(lever) > mujoco.mjMINVAL):
            return True
    return False


def _check_kind(model: Any, i: int, source: object) -> None:
    """Refuses an actuator that is neither a motor nor a position servo."""
    where = f"actuator {_name(model, i)}, "
    for name, (kind, known) in _KINDS.items():
        number = int(getattr(model, f"actuator_{name}")[i])
        found = kind(number).name.rpartition("_")[2].lower()
        if found not in known:
            raise InputError(source, f"{where}{name}", found, " or ".join(known))
    figures = {name: getattr(model, f"actuator_{name}")[i] for name in _ABSENT}
    refuse_nonzero(source, where, figures, "0: it is not simulated")
    gain, (constant, kp, kv) = float(model.actuator_gainprm[i, 0]), _bias(model, i)
    if _is_servo(model, i) and not (constant == 0.0 and -kp == gain > 0.0):
        found = f"a gain of {gain:g} and a bias of {constant:g} {kp:g} {kv:g}"
        valid = "a position servo: a gain of kp and a bias of 0 -kp -kv"
        raise InputError(source, f"{where}biasprm", found, valid)


def _check_targets(model: Any, i: int, joint: str, source: object) -> None:
    """Refuses a servo whose targets end before the range of the joint does."""
    at, number = model.actuator_ctrladr[i], model.joint(joint).id
    if not (model.actuator_ctrllimited[at] and model.jnt_limited[number]):
        return
    low, high = sorted(model.actuator_ctrlrange[at] / _gear(model, i))
    first, last = model.jnt_range[number]
    slack = _ROUNDING * (last - first)
    if low > first + slack or high < last - slack:
        where = f"actuator {_name(model, i)}, ctrlrange"
        valid = f"all of the joint's range of {first:g} to {last:g}"
        raise InputError(source, where, f"{low:g} to {high:g} at the joint", valid)


def _most(model: Any, i: int, source: object) -> float:
    """Largest effort of one actuator at its joint; that of a motor's control, too."""
    limit, where = math.inf, f"actuator {_name(model, i)}, "
    if model.actuator_forcelimited[i]:
        limit = _end(model.actuator_forcerange[i], f"{where}forcerange", source)
    at = model.actuator_ctrladr[i]
    if model.actuator_ctrllimited[at] and not _is_servo(model, i):
        control = _end(model.actuator_ctrlrange[at], f"{where}ctrlrange", source)
        limit = min(limit, control * abs(float(model.actuator_gainprm[i, 0])))
    return limit * abs(_gear(model, i))


def _end(ends: Any, where: str, source: object) -> float:
    """The end b of a range from -b to b: a limit of effort is the same both ways."""
    low, high = map(float, ends)
    if not math.isclose(-low, high):
        raise InputError(source, where, f"{low:g} {high:g}", "the same both ways")
    return high


def _name(model: Any, i: int) -> str:
    return model.actuator(i).name or f"number {i}"


def _is_servo(model: Any, i: int) -> bool:
    return bool(model.actuator_biastype[i] == int(mujoco.mjtBias.mjBIAS_AFFINE))


def _bias(model: Any, i: int) -> tuple[float, float, float]:
    """Its constant, and its share by length and by speed."""
    constant, kp, kv = map(float, model.actuator_biasprm[i, :3])
    return constant, kp, kv


def _gear(model: Any, i: int) -> float:
    return float(model.actuator_gear[model.actuator_outadr[i], 0])
