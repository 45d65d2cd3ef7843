"""Gains and limits of a user's actuators; the vendor's nominal ones where none are."""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float

from envs.errors import InputError
from envs.hand.importing.joint_map import DriveMap
from envs.hand.nominal import vendor_hand

_WHAT = {"kp": "kp of position servos", "force_limit": "torque limits"}
_SAME = 0.01
"""Relative difference up to which gains count as the vendor's nominal ones."""


@dataclass(frozen=True)
class ImportedDrive:
    """Drive parameters of the joints.

    Attributes:
        values: `kp` [N·m/rad], `kv` [N·m·s/rad], `force_limit` [N·m] and `armature`
            [kg·m²] of each.
        own: which of them are the model's own and not the vendor's nominal ones.
        notes: a sentence for all that was not taken from the model.
        mapped: which of them the user's map gives in the place of the model's.
    """

    values: dict[str, Float[np.ndarray, " joints"]]
    own: frozenset[str]
    notes: tuple[str, ...]
    mapped: frozenset[str] = frozenset()


def drive_of(
    model: mujoco.MjModel, joints: list[int], actuators: list[int]
) -> ImportedDrive:
    """Reads position servos, torque limits and armatures of a hand as the vendor's.

    A servo is `kp (command − q) − kv q̇` in joint angles; damping of the joint itself
    counts as part of its `kv`.

    Args:
        model: the user's.
        joints: the hinges.
        actuators: the actuator of each, or none.
    """
    found = _found(model, joints, actuators)
    nominal = {name: vendor_hand().per_joint(name) for name in found}
    lacking = [name for name, given in found.items() if not np.all(given > 0)]
    own = {
        name
        for name, given in found.items()
        if name not in lacking and not np.allclose(given, nominal[name], rtol=_SAME)
    }
    notes = tuple(
        f"no {_WHAT.get(name, name)} on all {len(joints)} joints: the vendor's instead"
        for name in lacking
    )
    notes += _friction_note(model, joints)
    chosen = {n: nominal[n] if n in lacking else found[n] for n in found}
    return ImportedDrive(chosen, frozenset(own), notes)


def own_drive_of(
    path: Path,
    model: mujoco.MjModel,
    joints: list[int],
    actuators: list[int],
    given: DriveMap,
) -> ImportedDrive:
    """Reads the same of any other hand; what the model lacks must be given.

    Args:
        path: of the model, for messages.
        model: the user's.
        joints: the hinges.
        actuators: the actuator of each, or none.
        given: numbers in the place of the model's.

    Raises:
        InputError: the model lacks gains or limits that are not given either.
    """
    found, notes = _found(model, joints, actuators), ()
    for name, values in found.items():
        number = getattr(given, name)
        if number is not None:
            found[name] = np.full(len(joints), number)
        elif name != "armature" and not np.all(values > 0):
            lacking = f"no {_WHAT.get(name, name)} on all {len(joints)} joints"
            raise InputError(
                path, "", lacking, f"some, or drive: {{{name}: …}} in the map"
            )
        elif not np.all(values > 0):
            notes += ("no armature on all joints: as the model has it",)
    notes += _friction_note(model, joints)
    mapped = frozenset(name for name in found if getattr(given, name) is not None)
    return ImportedDrive(found, frozenset(found), notes, mapped)


def _found(
    model: mujoco.MjModel, joints: list[int], actuators: list[int]
) -> dict[str, Float[np.ndarray, " joints"]]:
    """What the model says of its drives, 0 where it says nothing."""
    dofs = model.jnt_dofadr[joints]
    kp, kv, limit = _servos(model, joints, actuators)
    ranges, limited = model.jnt_actfrcrange[joints], model.jnt_actfrclimited[joints]
    of_joint = np.where(limited == 1, np.abs(ranges).min(axis=1), 0.0)
    servo = np.all(kp > 0)  # damping alone is none
    return {
        "kp": kp,
        "kv": kv + model.dof_damping[dofs] if servo else np.zeros(len(joints)),
        "force_limit": np.where(limit > 0, limit, of_joint),
        "armature": model.dof_armature[dofs].copy(),
    }


def _friction_note(model: mujoco.MjModel, joints: list[int]) -> tuple[str, ...]:
    if not np.any(model.dof_frictionloss[model.jnt_dofadr[joints]] > 0):
        return ()
    return ("dry friction of the joints is left out: it is an effect, see effects",)


def _servos(
    model: mujoco.MjModel, joints: list[int], actuators: list[int]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gain, damping and torque limit of each actuator, 0 where it has none."""
    if not actuators:
        none = np.zeros(len(joints))
        return none, none, none
    kp, bias = model.actuator_gainprm[actuators, 0], model.actuator_biasprm[actuators]
    servo = (
        (model.actuator_biastype[actuators] == mujoco.mjtBias.mjBIAS_AFFINE)
        & (model.actuator_gaintype[actuators] == mujoco.mjtGain.mjGAIN_FIXED)
        & (model.actuator_dyntype[actuators] == mujoco.mjtDyn.mjDYN_NONE)
        & (model.actuator_gear[actuators, 0] == 1.0)
        & np.isclose(kp, -bias[:, 1])
    )
    limited = model.actuator_forcelimited[actuators] == 1
    force = np.abs(model.actuator_forcerange[actuators]).min(axis=1)
    geared = force * np.abs(model.actuator_gear[actuators, 0])
    return (
        np.where(servo, kp, 0.0),
        np.where(servo, -bias[:, 2], 0.0),
        np.where(limited, geared, 0.0),
    )
