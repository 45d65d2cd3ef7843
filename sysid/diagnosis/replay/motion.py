"""Measured motion of one joint, as the replay reads it: arrays only."""

from dataclasses import dataclass

import flax.struct
import jax
import numpy as np
from jaxtyping import Array, Bool, Float, Int


@flax.struct.dataclass
class Motion:
    """Joint and rigid bodies along the motion, in all pieces (p), at all steps or one.

    Attributes:
        pos, vel, acc, jerk: encoder angle and its derivatives [rad], [rad/s], …
        slow_vel: speed that passed the band of the residuals, for friction [rad/s].
        effort: measured torque of the drive [N·m]; zero where it is not logged.
        push: torque of all that is neither drive nor gravity [N·m].
        ext: known push from outside, in its unit.
        inertia: of the joint with all that it carries, in this posture [kg·m²].
        moment: of the carried masses [kg·m]; see `envs.actuator.surroundings.Gravity`.
        axis: of a hinge, in the same frame; 0 for a slide [1].
        payload_moment, payload_shift, payload_inertia, payload_push: of a payload of
            1 kg; see `envs.actuator.surroundings.Gravity`.
        others_nm: sum of the other joints' |torque| [N·m].
        other_q, other_nm: angle and torque of the joint that may pull on this one.
    """

    pos: Float[Array, "*t p"]
    vel: Float[Array, "*t p"]
    acc: Float[Array, "*t p"]
    jerk: Float[Array, "*t p"]
    slow_vel: Float[Array, "*t p"]
    effort: Float[Array, "*t p"]
    push: Float[Array, "*t p"]
    ext: Float[Array, "*t p"]
    inertia: Float[Array, "*t p"]
    moment: Float[Array, "*t p 3"]
    axis: Float[Array, "*t p 3"]
    payload_moment: Float[Array, "*t p 3"]
    payload_shift: Float[Array, "*t p 3 3"]
    payload_inertia: Float[Array, "*t p"]
    payload_push: Float[Array, "*t p"]
    others_nm: Float[Array, "*t p"]
    other_q: Float[Array, "*t p"]
    other_nm: Float[Array, "*t p"]


@flax.struct.dataclass
class Track(Motion):
    """The motion at all steps (t), and what a piece has once.

    Attributes:
        cmd: target, mean over the step that ends there [rad].
        held, sent: the last targets (s) of a step, see `measured.segments.Piece`.
        resumed: 1 where a simulation begins anew, see `validity.begins_anew`.
        gravity: in the frame of the mount [m/s²].
        payload_kg: nominal mass of the payload [kg].
        kp, kd: nominal gains [N·m/rad], [N·m·s/rad].
        cascade: parameters of `cascade.KIND`; none without one.
        measured: 1 where the logged effort enters the gears, else 0.
        between: 1 where the law is known by which the command's ripple between the
            readings makes torque, else 0.
        noise: standard deviations of angle, its two derivatives and effort in both
            residuals, behind their band and what whitens them.
    """

    cmd: Float[Array, "t p"]
    held: Float[Array, "t s p"]
    sent: Float[Array, "t s p"]
    resumed: Float[Array, "t p"]
    gravity: Float[Array, "p 3"]
    payload_kg: Float[Array, " p"]
    kp: Float[Array, " p"]
    kd: Float[Array, " p"]
    cascade: dict[str, Float[Array, " p"]]
    measured: Float[Array, " p"]
    between: Float[Array, ""]
    noise: Float[Array, "2 4"]


@dataclass(frozen=True, eq=False)
class JointTrack:
    """The track of one joint and where its residuals count.

    Attributes:
        joint: name.
        track: for `residuals.equation_error`; pieces are padded to one length.
        dt: step of the grid [s].
        valid: where residual samples (m) of the pieces (p) count.
        moving: where the joint is certainly not at rest (m, p).
        uncertainty: of both residuals beyond their usual noise; see
            `timing_uncertainty` [N·m] (2, m, p).
        pushed: of what other joints push, as sampled and read [N·m] (t, p).
        unread: how far the angle may err between its rows; see `Piece` [rad] (t, p).
        other: joint whose angle and effort are in the track; its own without others.
        neighbours: angle and effort (2, t, p) of every joint that may pull on it.
        armature: part of the inertia that the model gives to the drive [kg·m²].
        log: record that a piece is from.
        start_s: time at which a piece starts [s].
        effort: whether the effort was logged, for every piece.
        noise: white noise of angle [rad] and effort [N·m] per step of the grid.
        slide: whether the joint moves along a line: units are m and N.
        friction_speed: speed below which the joint may be at rest.
        torque_scale, speed_scale, angle_scale: sizes that occur [N·m], [rad/s], [rad].
    """

    joint: str
    track: Track
    dt: float
    valid: Bool[np.ndarray, "m p"]
    moving: Bool[np.ndarray, "m p"]
    uncertainty: Float[np.ndarray, "2 m p"]
    pushed: Float[np.ndarray, "t p"]
    unread: Float[np.ndarray, "t p"]
    other: str
    neighbours: dict[str, Float[np.ndarray, "2 t p"]]
    armature: float
    log: Int[np.ndarray, " p"]
    start_s: Float[np.ndarray, " p"]
    effort: Bool[np.ndarray, " p"]
    noise: tuple[float, float]
    friction_speed: float
    slide: bool
    torque_scale: float
    speed_scale: float
    angle_scale: float


def motion_of(track: Track) -> Motion:
    """The part of a track that changes from step to step."""
    names = Motion.__dataclass_fields__
    return Motion(**{name: getattr(track, name) for name in names})


def with_candidates(motion: Motion) -> Motion:
    """Gives one step of the motion a last axis for the candidates."""
    return jax.tree.map(lambda v: v[:, None], motion)
