"""Gravity and inertia around one joint along given postures, from the MuJoCo model."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from envs.actuator.surroundings import Gravity, Surroundings
from envs.quiet_mujoco import mujoco
from sysid.excitation.plan import joint_address
from sysid.mechanism import Mechanism

_EVERY = 4
"""Rows between two postures that are evaluated; joints move little in between."""


def rigid_along(
    mechanism: Mechanism,
    targets: Float[np.ndarray, "n j"],
    j: int,
    gravity: Float[np.ndarray, "3"] | None = None,
) -> tuple[Surroundings, Float[np.ndarray, " n"], float]:
    """Evaluates the rigid bodies around one joint along postures.

    Args:
        mechanism: the simulation as it stands.
        targets: angles of all joints that have a drive [rad].
        j: number of the joint.
        gravity: in the frame of the mount [m/s²]; the model's if not given.

    Returns:
        What surrounds the joint at every row, the change of gravity's torque with its
        angle [N·m/rad], and its mean inertia [kg·m²].
    """
    model, data = mechanism.model, mujoco.MjData(mechanism.model)
    pull = model.opt.gravity if gravity is None else gravity
    qpos, dofs = joint_address(mechanism)
    found: list[tuple[np.ndarray, ...]] = []
    inertia, unit, moved = [], np.eye(model.nv)[dofs[j]], np.zeros(model.nv)
    slopes = []
    for posture in targets[::_EVERY]:
        data.qpos[qpos] = posture
        data.qpos[qpos[j]] += 1e-3
        mujoco.mj_forward(model, data)
        ahead = _moments(model, data, int(dofs[j]))[0]
        data.qpos[qpos[j]] -= 1e-3
        mujoco.mj_forward(model, data)
        found.append(_moments(model, data, int(dofs[j])))
        slopes.append((ahead - found[-1][0]) @ pull / 1e-3)
        mujoco.mj_mulM(model, data, moved, unit)
        inertia.append(moved[dofs[j]])
    moment, payload, shift = (
        _between(np.array(x), len(targets)) for x in zip(*found, strict=True)
    )
    payload_kg = model.body_mass[_carrier(model, int(dofs[j]))]
    other = j + 1 if j + 1 < targets.shape[1] else j - 1
    rows = len(targets)
    world = Gravity(
        gravity=jnp.tile(jnp.asarray(pull), (rows, 1)),
        moment=jnp.asarray(moment),
        payload_kg=jnp.full(rows, payload_kg),
        payload_moment=jnp.asarray(payload),
        payload_shift=jnp.asarray(shift),
        payload_inertia=jnp.sum(jnp.asarray(payload) ** 2, -1),
    )
    around = Surroundings(
        others_nm=None,
        other_q=jnp.asarray(targets[:, other] if other >= 0 else np.zeros(rows)),
        other_nm=jnp.zeros(rows),
        gravity=world,
    )
    stiffness = _between(np.array(slopes), rows)
    return around, stiffness, float(np.mean(inertia))


def gravity_torque(around: Surroundings) -> Float[np.ndarray, " n"]:
    """Returns the torque of gravity on the joint at every row [N·m]."""
    world = around.gravity
    assert world is not None
    return np.sum(np.asarray(world.moment) * np.asarray(world.gravity), -1)


def _between(values: np.ndarray, rows: int) -> np.ndarray:
    """Fills the rows between those that were evaluated; the last value stays."""
    place = np.minimum(np.arange(rows) / _EVERY, len(values) - 1.0)
    low = np.minimum(place.astype(int), max(len(values) - 2, 0))
    share = (place - low).reshape(-1, *[1] * (values.ndim - 1))
    high = np.minimum(low + 1, len(values) - 1)
    return (1.0 - share) * values[low] + share * values[high]


def _carrier(model: mujoco.MjModel, dof: int) -> int:
    """Returns the last body of a joint's chain, which would carry a payload."""
    body = int(model.dof_bodyid[dof])
    for child in range(body + 1, model.nbody):
        if model.body_parentid[child] == body:
            body = child
    return body


def _moments(model: mujoco.MjModel, data: mujoco.MjData, dof: int):
    """Returns moments a × r of what a joint carries and of its payload.

    That is: of all masses [kg·m], of a payload of 1 kg [m], and the change of the
    latter by a shift along the axes of its body.
    """
    jacobian, turns = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    body, carrier = int(model.dof_bodyid[dof]), _carrier(model, dof)
    mujoco.mj_jacSubtreeCom(model, data, jacobian, body)
    moment = model.body_subtreemass[body] * jacobian[:, dof]
    mujoco.mj_jacBodyCom(model, data, jacobian, turns, carrier)
    axis, frame = turns[:, dof], data.xmat[carrier].reshape(3, 3)
    return moment, jacobian[:, dof].copy(), np.cross(axis, frame.T)
