"""Rigid-body dynamics along the measured motion of a mechanism."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from envs.quiet_mujoco import mujoco
from sysid.diagnosis.measured.segments import Piece
from sysid.logs.log import MeasuredLog
from sysid.mechanism import Mechanism

PAYLOAD = "payload"
"""Name of the body that carries the load, where there is one."""


@dataclass(frozen=True, eq=False)
class Bodies:
    """What rigid-body dynamics says along one piece, for all joints of the model (v).

    Attributes:
        inertia: diagonal of the mass matrix.
        moment, turned: see `Track`.
        push: torque of the other joints' motion on each joint.
        payload_moment, payload_shift, payload_inertia: see `effects.surroundings`.
        payload_kg: mass of the payload by joint.
    """

    inertia: Float[np.ndarray, "n v"]
    moment: Float[np.ndarray, "n v 3"]
    turned: Float[np.ndarray, "n v 3"]
    push: Float[np.ndarray, "n v"]
    payload_moment: Float[np.ndarray, "n v 3"]
    payload_shift: Float[np.ndarray, "n v 3 3"]
    payload_inertia: Float[np.ndarray, "n v"]
    payload_kg: Float[np.ndarray, " v"]
    gravity: Float[np.ndarray, "3"]


def bodies_along(
    mechanism: Mechanism, log: MeasuredLog, piece: Piece, joints: tuple[str, ...]
) -> Bodies:
    """Evaluates the rigid bodies along a piece.

    Postures change slowly against the grid: every fourth is evaluated, the others lie
    on straight lines between them.
    """
    model = mechanism.model
    data = mujoco.MjData(model)
    ids = [model.joint(j).id for j in joints]
    adr, dof = model.jnt_qposadr[ids], model.jnt_dofadr[ids]
    body = model.jnt_bodyid[ids]
    payload = _payload(model, body)
    rows = np.unique(np.append(np.arange(0, len(piece.t_s), 4), len(piece.t_s) - 1))
    matrix = np.zeros((model.nv, model.nv))
    found: dict[str, list] = {
        k: [] for k in ("m", "axis", "anchor", "com", "at", "frame", "rate")
    }
    for k in rows:
        data.qpos[adr], data.qvel[dof] = piece.pos[k], piece.vel[k]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_crb(model, data)
        mujoco.mj_fullM(model, data, matrix)
        found["m"].append(matrix[np.ix_(dof, dof)])
        found["axis"].append(data.xaxis[ids])
        found["anchor"].append(data.xanchor[ids])
        found["com"].append(data.subtree_com[body])
        found["at"].append(data.xipos[payload])
        found["frame"].append(data.xmat[payload].reshape(-1, 3, 3))
        found["rate"].append(
            _coriolis(model, data)[dof] if len(dof) > 1 else np.zeros(1)
        )
    f = {key: np.array(values) for key, values in found.items()}
    hinge = (model.jnt_type[ids] == int(mujoco.mjtJoint.mjJNT_HINGE))[:, None]
    mass = model.body_subtreemass[body][:, None]
    turn = np.cross(f["axis"], f["com"] - f["anchor"])
    arm = np.where(hinge, np.cross(f["axis"], f["at"] - f["anchor"]), f["axis"])
    shift = np.cross(f["axis"][:, :, None], np.swapaxes(f["frame"], 2, 3))
    coarse = {
        "moment": mass * np.where(hinge, turn, f["axis"]),
        "turned": mass * np.where(hinge, np.cross(f["axis"], turn), 0.0),
        "payload_moment": arm,
        "payload_shift": np.where(hinge[..., None], shift, 0.0),
        "payload_inertia": np.sum(arm**2, -1),
        "m": f["m"],
        "rate": f["rate"],
    }
    fine = {k: _between(rows, v, len(piece.t_s)) for k, v in coarse.items()}
    m, rate = fine.pop("m"), fine.pop("rate")
    inertia = np.diagonal(m, axis1=1, axis2=2)
    push = inertia * piece.acc - np.einsum("nij,nj->ni", m, piece.acc) - rate
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, np.asarray(log.header.palm_quat_w))
    gravity = rotation.reshape(3, 3).T @ model.opt.gravity
    return Bodies(
        payload_kg=model.body_mass[payload],
        gravity=gravity,
        inertia=inertia,
        push=push,
        **fine,
    )


def _between(rows: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """Fills the steps between those that were evaluated."""
    steps = np.arange(count)
    right = np.clip(np.searchsorted(rows, steps, "left"), 1, len(rows) - 1)
    share = (steps - rows[right - 1]) / (rows[right] - rows[right - 1])
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    return (1.0 - share) * values[right - 1] + share * values[right]


def _coriolis(model, data) -> np.ndarray:
    """Torque of velocities alone on all joints."""
    kept, model.opt.gravity[:] = model.opt.gravity.copy(), 0.0
    result = np.zeros(model.nv)
    try:
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, result)
    finally:
        model.opt.gravity[:] = kept
    return result


def _payload(model, body: np.ndarray) -> np.ndarray:
    """Returns for every joint the body that carries its load.

    The body named `payload` where there is one, else the last body of the joint's
    chain.
    """
    named = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, PAYLOAD)
    result = []
    for start in body:
        below = [start]
        for i in range(start + 1, model.nbody):
            if model.body_parentid[i] in below:
                below.append(i)
        result.append(named if named in below else below[-1])
    return np.array(result)
