"""Rigid-body dynamics around joints along a motion, from the MuJoCo model."""

import copy
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from envs.actuator.surroundings import Gravity
from envs.physics.quiet_mujoco import mujoco
from sysid.carried import carrying_bodies
from sysid.mechanism import Mechanism

_MOST = 4
"""Largest number of rows between two postures that are evaluated."""

_CHORD_RAD = 5e-4
"""Largest distance of a joint from the straight line between two such postures."""


@dataclass(frozen=True, eq=False)
class Bodies:
    """What rigid-body dynamics says along n rows, for some joints of a model (v).

    The torque of gravity g on a joint is m · g with the moment m = mass (a × r) of all
    masses that it carries, and changes by (a × m) · g with its angle.

    Attributes:
        matrix: mass matrix of the joints, with what the model gives to their drives
            [kg·m²].
        moment: m, in the frame of the mount [kg·m].
        axis: a of a hinge, in that frame; 0 for a slide [1].
        push: torque of the other joints' motion on each joint [N·m].
        payload_moment, payload_shift, payload_inertia, payload_push: see `Gravity`.
        payload_kg: mass of the payload by joint.
        gravity: in the frame of the mount [m/s²].
    """

    matrix: Float[np.ndarray, "n v v"]
    moment: Float[np.ndarray, "n v 3"]
    axis: Float[np.ndarray, "n v 3"]
    push: Float[np.ndarray, "n v"]
    payload_moment: Float[np.ndarray, "n v 3"]
    payload_shift: Float[np.ndarray, "n v 3 3"]
    payload_inertia: Float[np.ndarray, "n v"]
    payload_push: Float[np.ndarray, "n v"]
    payload_kg: Float[np.ndarray, " v"]
    gravity: Float[np.ndarray, "3"]

    @property
    def inertia(self) -> Float[np.ndarray, "n v"]:
        """Inertia of each joint alone [kg·m²]."""
        return np.diagonal(self.matrix, axis1=1, axis2=2)

    @property
    def weight(self) -> Float[np.ndarray, "n v"]:
        """Torque of gravity on each joint, m · g [N·m]."""
        return self.moment @ self.gravity

    @property
    def weight_slope(self) -> Float[np.ndarray, "n v"]:
        """Its change with the joint's angle, (a × m) · g [N·m/rad]."""
        return np.cross(self.axis, self.moment) @ self.gravity

    def gravity_on(self, j: int) -> Gravity:
        """Gravity's effect on one joint, row by row."""
        rows = len(self.moment)
        return Gravity(
            gravity=jnp.tile(jnp.asarray(self.gravity), (rows, 1)),
            moment=jnp.asarray(self.moment[:, j]),
            payload_kg=jnp.full(rows, self.payload_kg[j]),
            payload_moment=jnp.asarray(self.payload_moment[:, j]),
            payload_shift=jnp.asarray(self.payload_shift[:, j]),
            payload_inertia=jnp.asarray(self.payload_inertia[:, j]),
            payload_push=jnp.asarray(self.payload_push[:, j]),
        )


@dataclass(frozen=True, eq=False)
class JointMotion:
    """Angles of joints (v) on even rows, with their derivatives per second."""

    pos: Float[np.ndarray, "n v"]
    vel: Float[np.ndarray, "n v"]
    acc: Float[np.ndarray, "n v"]


def at_rest(pos: Float[np.ndarray, "n v"]) -> JointMotion:
    """q̇ = q̈ = 0 at every one of some postures.

    Args:
        pos: q [rad].

    Source:
        Ours: postures that are passed so slowly that only gravity counts.
    """
    return JointMotion(pos, np.zeros_like(pos), np.zeros_like(pos))


def mount_gravity(
    mechanism: Mechanism, quat_w: tuple[float, float, float, float]
) -> Float[np.ndarray, "3"]:
    """g_v = Rᵀ g_w, gravity in the frame of a mount of the given orientation [m/s²].

    Args:
        mechanism: its model has g_w.
        quat_w: unit quaternion of R, (w, x, y, z) [1].

    Source:
        MuJoCo documentation, "Computation", conventions of frames.
    """
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, np.asarray(quat_w))
    return rotation.reshape(3, 3).T @ mechanism.model.opt.gravity


def bodies_along(
    mechanism: Mechanism,
    joints: tuple[str, ...],
    motion: JointMotion,
    gravity: Float[np.ndarray, "3"],
) -> Bodies:
    """M(q) q̈ + c(q, q̇) = τ + m(q) · g, its terms for each joint along a motion.

    The push of the others is M_ii q̈_i − Σ_k M_ik q̈_k − c_i. Postures change slowly from
    row to row: where they bend little every fourth is evaluated, and the others lie on
    straight lines between.

    Args:
        mechanism: the simulation as it stands.
        joints: names of the joints that move; the others stay at 0.
        motion: angles [rad], speeds [rad/s] and accelerations [rad/s²].
        gravity: g in the frame of the mount [m/s²].

    Source:
        R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5 and 6, as in
        MuJoCo's mj_crb and mj_rne.
    """
    model = mechanism.model
    ids = [model.joint(j).id for j in joints]
    body = model.jnt_bodyid[ids]
    payload = carrying_bodies(model, body)
    count = len(motion.pos)
    rows = np.unique(np.append(np.arange(0, count, _apart(motion.pos)), count - 1))
    f = _evaluated(model, ids, payload, motion, rows)
    hinge = (model.jnt_type[ids] == int(mujoco.mjtJoint.mjJNT_HINGE))[:, None]
    mass = model.body_subtreemass[body][:, None]
    spin = np.einsum("njkl,njk->njl", f["inertial"], f["axis"]) ** 2
    turn = np.cross(f["axis"], f["com"] - f["anchor"])
    arm = np.where(hinge, np.cross(f["axis"], f["at"] - f["anchor"]), f["axis"])
    shift = np.cross(f["axis"][:, :, None], np.swapaxes(f["frame"], 2, 3))
    coarse = {
        "moment": mass * np.where(hinge, turn, f["axis"]),
        "axis": np.where(hinge, f["axis"], 0.0),
        "payload_moment": arm,
        "payload_shift": np.where(hinge[..., None], shift, 0.0),
        "payload_inertia": np.sum(arm**2 + hinge * spin * _shape(model, payload), -1),
        "matrix": f["m"],
        "rate": f["rate"],
    }
    fine = {k: interpolated(rows, v, count) for k, v in coarse.items()}
    push = _push(fine["matrix"], fine.pop("rate"), motion)
    return Bodies(
        payload_kg=model.body_mass[payload],
        gravity=gravity,
        push=push,
        payload_push=_payload_push(model, ids, payload, motion, rows) - push,
        **fine,
    )


def _push(
    matrix: Float[np.ndarray, "n v v"],
    rate: Float[np.ndarray, "n v"],
    motion: JointMotion,
) -> Float[np.ndarray, "n v"]:
    """M_ii q̈_i − Σ_k M_ik q̈_k − c_i."""
    inertia = np.diagonal(matrix, axis1=1, axis2=2)
    return inertia * motion.acc - np.einsum("nij,nj->ni", matrix, motion.acc) - rate


def _shape(
    model: mujoco.MjModel, bodies: Int[np.ndarray, " v"]
) -> Float[np.ndarray, "v 3"]:
    """Principal inertias of 1 kg that is spread as each body's own mass is [m²]."""
    mass = model.body_mass[bodies][:, None]
    return model.body_inertia[bodies] / np.where(mass > 0.0, mass, 1.0)


def _payload_push(
    model: mujoco.MjModel,
    ids: list[int],
    payload: Int[np.ndarray, " v"],
    motion: JointMotion,
    rows: Int[np.ndarray, " k"],
) -> Float[np.ndarray, "n v"]:
    """The push of the other joints where each payload is heavier by 1 kg."""
    pushes = np.zeros_like(motion.pos)
    for body in np.unique(payload) if len(ids) > 1 else ():
        heavier = copy.copy(model)
        heavier.body_inertia[body] += _shape(model, np.array([body]))[0]
        heavier.body_mass[body] += 1.0
        found = _evaluated(heavier, ids, payload, motion, rows)
        fine = [interpolated(rows, found[k], len(motion.pos)) for k in ("m", "rate")]
        felt = payload == body
        pushes[:, felt] = _push(fine[0], fine[1], motion)[:, felt]
    return pushes


def _evaluated(
    model: mujoco.MjModel,
    ids: list[int],
    payload: Int[np.ndarray, " v"],
    motion: JointMotion,
    rows: Int[np.ndarray, " k"],
) -> dict[str, np.ndarray]:
    """Mass matrix, axes, places and Coriolis torques at some rows."""
    data = mujoco.MjData(model)
    adr, dof = model.jnt_qposadr[ids], model.jnt_dofadr[ids]
    matrix = np.zeros((model.nv, model.nv))
    found: dict[str, list] = {
        k: [] for k in ("m", "axis", "anchor", "com", "at", "frame", "inertial", "rate")
    }
    for k in rows:
        data.qpos[adr], data.qvel[dof] = motion.pos[k], motion.vel[k]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_crb(model, data)
        mujoco.mj_fullM(model, data, matrix)
        found["m"].append(matrix[np.ix_(dof, dof)])
        found["axis"].append(data.xaxis[ids])
        found["anchor"].append(data.xanchor[ids])
        found["com"].append(data.subtree_com[model.jnt_bodyid[ids]])
        found["at"].append(data.xipos[payload])
        found["frame"].append(data.xmat[payload].reshape(-1, 3, 3))
        found["inertial"].append(data.ximat[payload].reshape(-1, 3, 3))
        found["rate"].append(
            _coriolis(model, data)[dof] if len(dof) > 1 else np.zeros(1)
        )
    return {key: np.array(values) for key, values in found.items()}


def _apart(pos: Float[np.ndarray, "n j"]) -> int:
    """Rows between postures: a chord over k rows misses a bend Δ²q by k² Δ²q / 8."""
    bend = float(np.max(np.abs(np.diff(pos, 2, axis=0)), initial=0.0))
    return int(np.clip(np.sqrt(8.0 * _CHORD_RAD / max(bend, 1e-12)), 1, _MOST))


def interpolated(
    rows: Int[np.ndarray, " k"], values: Float[np.ndarray, "k ..."], count: int
) -> Float[np.ndarray, "n ..."]:
    """y_t = (1 − s) y_a + s y_b with s = (t − a) / (b − a), between rows a ≤ t ≤ b.

    Args:
        rows: numbers of the steps that have values, increasing [steps].
        values: of any unit.
        count: number n of steps; after the last row its value stays.

    Source:
        Textbook linear interpolation.
    """
    steps = np.arange(count)
    right = np.clip(np.searchsorted(rows, steps, "left"), 1, len(rows) - 1)
    share = (steps - rows[right - 1]) / (rows[right] - rows[right - 1])
    share = np.minimum(share, 1.0).reshape(-1, *[1] * (values.ndim - 1))
    return (1.0 - share) * values[right - 1] + share * values[right]


def _coriolis(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Torque of velocities alone on all joints."""
    kept, model.opt.gravity[:] = model.opt.gravity.copy(), 0.0
    result = np.zeros(model.nv)
    try:
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, result)
    finally:
        model.opt.gravity[:] = kept
    return result
