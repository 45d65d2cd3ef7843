"""Gains and limits of a user's actuators; the vendor's nominal ones where none are."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from envs.hand.nominal import vendor_hand

_SAME = 0.01
"""Relative difference up to which gains count as the vendor's nominal ones."""


@dataclass(frozen=True)
class ImportedDrive:
    """Drive parameters of the 20 joints.

    Attributes:
        values: `kp` [N·m/rad], `kv` [N·m·s/rad], `force_limit` [N·m] and `armature`
            [kg·m²], 20 each.
        own: which of them are the model's own and not the vendor's nominal ones.
        notes: a sentence for all that was not taken from the model.
    """

    values: dict[str, Float[np.ndarray, "20"]]
    own: frozenset[str]
    notes: tuple[str, ...]


def drive_of(
    model: mujoco.MjModel, joints: list[int], actuators: list[int]
) -> ImportedDrive:
    """Reads position servos, torque limits and armatures.

    A servo is `kp (command − q) − kv q̇` in joint angles; damping of the joint itself
    counts as part of its `kv`.

    Args:
        model: the user's.
        joints: the 20 hinges.
        actuators: the actuator of each, or none.
    """
    dofs = model.jnt_dofadr[joints]
    kp, kv, limit = _servos(model, actuators)
    ranges, limited = model.jnt_actfrcrange[joints], model.jnt_actfrclimited[joints]
    of_joint = np.where(limited == 1, np.abs(ranges).min(axis=1), 0.0)
    found = {
        "kp": kp,
        "kv": kv + model.dof_damping[dofs],
        "force_limit": np.where(limit > 0, limit, of_joint),
        "armature": model.dof_armature[dofs],
    }
    if not np.all(kp > 0):  # damping alone is no servo
        found["kv"] = np.zeros(20)
    nominal = {name: vendor_hand().per_joint(name) for name in found}
    lacking = [name for name, given in found.items() if not np.all(given > 0)]
    own = {
        name
        for name, given in found.items()
        if name not in lacking and not np.allclose(given, nominal[name], rtol=_SAME)
    }
    what = {"kp": "kp of position servos", "force_limit": "torque limits"}
    notes = tuple(
        f"no {what.get(name, name)} on all 20 joints: the vendor's instead"
        for name in lacking
    )
    if np.any(model.dof_frictionloss[dofs] > 0):
        notes += (
            "dry friction of the joints is left out: it is an effect, see effects",
        )
    chosen = {n: nominal[n] if n in lacking else found[n] for n in found}
    return ImportedDrive(chosen, frozenset(own), notes)


def _servos(
    model: mujoco.MjModel, actuators: list[int]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gain, damping and torque limit of each actuator, 0 where it has none."""
    if not actuators:
        return np.zeros(20), np.zeros(20), np.zeros(20)
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
