"""What the page shows of one control step, as plain arrays in the world's frame."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from envs.hand.model import V_SITE
from fingers_mjx.evaluation.record import Trace
from fingers_mjx.play.player import Episode
from rewards.lift import LiftParams, lift_gate

MOVING = 1
"""The first body that is not the world."""


@dataclass(frozen=True)
class Poses:
    """Where frames are.

    Attributes:
        pos_w: origins [m].
        quat_w: orientations, w x y z.
    """

    pos_w: Float[np.ndarray, "n 3"]
    quat_w: Float[np.ndarray, "n 4"]


@dataclass(frozen=True)
class Arrows:
    """Vectors and the points at which they act.

    Attributes:
        at_w: points [m].
        force_w: forces on the body that moves [N].
    """

    at_w: Float[np.ndarray, "n 3"]
    force_w: Float[np.ndarray, "n 3"]


@dataclass(frozen=True)
class Springs:
    """The footprint's springs, from each fingertip to its target.

    Attributes:
        tip_w: fingertips p [m].
        target_w: targets p* [m], fixed to V.
    """

    tip_w: Float[np.ndarray, "tips 3"]
    target_w: Float[np.ndarray, "tips 3"]


@dataclass(frozen=True)
class Lifts:
    """What the lift objective sees, see `rewards.lift`.

    Attributes:
        phase_rad: φ in [0, 2π).
        average_mps: z of each tip, real and imaginary part.
        paid: whether each tip's gate is open.
    """

    phase_rad: float
    average_mps: Float[np.ndarray, "tips 2"]
    paid: Bool[np.ndarray, " tips"]


@dataclass(frozen=True)
class View:
    """One control step.

    Attributes:
        bodies: of the model, from `MOVING` on.
        frame_v: origin and axes of V.
        contacts: forces at the contact points.
        springs: None where the task has no footprint.
        lifts: None where the task has no lift objective.
        command: v_x, v_y [m/s] and yaw rate [rad/s], in V.
        velocity: the same, achieved.
        push: of the person, on the palm; None without.
    """

    bodies: Poses
    frame_v: Poses
    contacts: Arrows
    springs: Springs | None
    lifts: Lifts | None
    command: Float[np.ndarray, "3"]
    velocity: Float[np.ndarray, "3"]
    push: Arrows | None = None


def view_of(episode: Episode, row: Trace) -> View:
    """Returns what there is to see after a control step.

    Args:
        episode: after the step.
        row: of the step, from `Player.step`.
    """
    model, data = episode.model, episode.data
    velocity = np.append(np.asarray(row.vel_v), row.yaw_rate)
    return View(
        bodies=body_poses(data),
        frame_v=_frame(data),
        contacts=contact_forces(model, data),
        springs=_springs(episode, row),
        lifts=_lifts(episode, row),
        command=np.asarray(row.command, float),
        velocity=velocity.astype(float),
    )


def body_poses(data: mujoco.MjData) -> Poses:
    """Returns the poses of all bodies but the world."""
    return Poses(data.xpos[MOVING:].copy(), data.xquat[MOVING:].copy())


def contact_forces(model: mujoco.MjModel, data: mujoco.MjData) -> Arrows:
    """Returns where bodies touch and with what force, f_w = Rᵀ f_c [N].

    The force is that on the contact's second body, or on the first if the second does
    not move; R has the contact's axes as rows.

    Source:
        MuJoCo documentation, `mj_contactForce`.
    """
    at, forces, wrench = [], [], np.zeros(6)
    for index, contact in enumerate(data.contact):
        mujoco.mj_contactForce(model, data, index, wrench)
        force_w = contact.frame.reshape(3, 3).T @ wrench[:3]
        fixed = model.geom_bodyid[contact.geom[1]] < MOVING
        if wrench[0] > 0.0:
            at.append(contact.pos.copy())
            forces.append(-force_w if fixed else force_w)
    return Arrows(np.reshape(at, (-1, 3)), np.reshape(forces, (-1, 3)))


def _frame(data: mujoco.MjData) -> Poses:
    site, quat = data.site(V_SITE), np.zeros(4)
    mujoco.mju_mat2Quat(quat, site.xmat)
    return Poses(site.xpos.copy()[None], quat[None])


def _springs(episode: Episode, row: Trace) -> Springs | None:
    """Returns the springs; both ends are known relative to the palm in V."""
    footprint = episode.memory.world.footprint
    if footprint is None or not bool(footprint.captured):
        return None
    site = episode.data.site(V_SITE)
    v_to_w = site.xmat.reshape(3, 3).T
    tip, target = np.asarray(row.tip_pos_v), np.asarray(footprint.target_v)
    return Springs(site.xpos + tip @ v_to_w, site.xpos + target @ v_to_w)


def _lifts(episode: Episode, row: Trace) -> Lifts | None:
    lift = episode.memory.lift
    if lift is None:
        return None
    paid = lift_gate(row.tip_force_n, lift.touched, row.command[:2], LiftParams())
    return Lifts(float(lift.phase), np.asarray(lift.average), np.asarray(paid))
