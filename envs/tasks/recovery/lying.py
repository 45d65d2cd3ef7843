"""A hand that lies: how its fingers curl, how it is laid down, which way is down."""

import mujoco
import numpy as np
from jaxtyping import Float

from envs.hand.model import FLOOR, PHYSICS_DT_S
from envs.hand.stance import SETTLE_S, Stance

_CURL_S = 1.5
_GAP_M = 0.002


def clearance_m(model: mujoco.MjModel, qpos: Float[np.ndarray, " nq"]) -> float:
    """Least distance of the hand to the floor, d = min over geoms.

    Args:
        model: the scene.
        qpos: generalized position [m, rad].

    Returns:
        Distance [m]; below 0 the hand reaches into the floor.

    Source:
        Ours, by MuJoCo's `mj_geomDistance`.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    floor = model.geom(FLOOR).id
    others = (geom for geom in range(model.ngeom) if geom != floor)
    return min(
        mujoco.mj_geomDistance(model, data, floor, geom, 5.0, None) for geom in others
    )


def down_b(qpos: Float[np.ndarray, " nq"]) -> Float[np.ndarray, "3"]:
    """Direction of gravity in the palm frame, g = q* ⊗ (0, 0, −1) ⊗ q.

    Args:
        qpos: generalized position [m, rad], with the orientation q of the palm.

    Returns:
        Unit vector [1].

    Source:
        As `envs.signals.gravity`, in float64.
    """
    down = np.zeros(3)
    mujoco.mju_rotVecQuat(
        down, np.array([0.0, 0.0, -1.0]), qpos[3:7] * np.array([1, -1, -1, -1])
    )
    return down


def turned_down(axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "4"]:
    """Orientation in which a direction a in the palm frame points down.

    q = (1 − a_z, −a_y, a_x, 0)/‖·‖, the shortest turn of a to −z; a is not +z.

    Args:
        axis: a, of any length > 0 [1].

    Returns:
        Unit quaternion w x y z [1].

    Source:
        The half-way construction: 1 + a·b beside a × b, with b = −z.
    """
    x, y, z = axis / np.linalg.norm(axis)
    quat = np.array([1.0 - z, -y, x, 0.0])
    return quat / np.linalg.norm(quat)


def curl(
    model: mujoco.MjModel, stance: Stance, target: Float[np.ndarray, " joints"]
) -> Float[np.ndarray, " joints"]:
    """Joint angles after the fingers have curled from the stance, without weight.

    The servos follow θ(t) = θ* + (θ_1 − θ*) min(1, 1.5 t/T), T = 1.5 s.

    Args:
        model: the hand.
        stance: with its joint targets θ*.
        target: joint targets θ_1 at the end [rad].

    Returns:
        Joint angles [rad].

    Source:
        Paper, fall recovery (fingers curled); the motion is ours.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = stance.qpos
    data.qpos[2] = 1.0
    start, steps = np.array(stance.target_rad), round(_CURL_S / PHYSICS_DT_S)
    flags = model.opt.disableflags
    model.opt.disableflags = flags | int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    for step in range(steps):
        data.ctrl[:] = start + (target - start) * min(1.0, 1.5 * step / steps)
        mujoco.mj_step(model, data)
    model.opt.disableflags = flags
    return data.qpos[7:].copy()


def lie_down(
    model: mujoco.MjModel,
    joints: Float[np.ndarray, " joints"],
    target: Float[np.ndarray, " joints"],
    quat: Float[np.ndarray, "4"],
    duration_s: float = SETTLE_S,
) -> mujoco.MjData:
    """Puts the hand down just above the floor and lets it sink or settle.

    It starts 2 mm above the floor, `clearance_m` = 0.002.

    Args:
        model: the hand on its floor.
        joints: joint angles at the start [rad].
        target: joint targets that are held [rad].
        quat: orientation at the start, w x y z.
        duration_s: time that is simulated [s].

    Returns:
        The state after it, above the world's origin.

    Source:
        Ours.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = [0.0, 0.0, 1.0, *quat, *joints]
    data.qpos[2] -= clearance_m(model, data.qpos) - _GAP_M
    data.ctrl[:] = target
    for _ in range(round(duration_s / PHYSICS_DT_S)):
        mujoco.mj_step(model, data)
    data.qpos[:2] = 0.0
    return data


def rounded(values: Float[np.ndarray, " n"]) -> tuple[float, ...]:
    """Numbers as they are stored, x ← ⌊10⁹ x⌉/10⁹, in their unit ([m], [rad]).

    Source:
        Ours.
    """
    return tuple(round(float(value), 9) for value in values)
