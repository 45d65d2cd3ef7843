"""From the records of a mechanism to the measured track of one of its joints."""

from collections.abc import Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from envs.errors import InputError, one_of
from sysid.diagnosis.measured.checks import check_records
from sysid.diagnosis.measured.resampling import SMOOTH_STEPS, smoothed
from sysid.diagnosis.measured.segments import (
    FINER,
    SLOW_S,
    Piece,
    grid_step_s,
    pieces_of,
)
from sysid.diagnosis.replay.residuals import BAND_STEPS, EVERY, Track, sample_rows
from sysid.diagnosis.replay.timing_uncertainty import sampling_doubt, timing_doubt
from sysid.logs.log import MeasuredLog
from sysid.mechanism import JointDrive, Mechanism
from sysid.rigid import JointMotion, bodies_along, mount_gravity


@dataclass(frozen=True, eq=False)
class JointTrack:
    """The track of one joint and where its residuals count.

    Attributes:
        joint: name.
        track: for `forced_residuals`; pieces are padded to one length.
        dt: step of the grid [s].
        valid: where residual samples (m) of the pieces (p) count.
        moving: where the joint is certainly not at rest (m, p).
        doubt: about both residuals, beyond their usual noise; see `diagnose_doubt`
            [N·m] (2, m, p).
        other: joint whose angle and effort are in the track; its own without others.
        neighbours: angle and effort (2, t, p) of every joint that may pull on it.
        armature: part of the inertia that the model gives to the drive [kg·m²].
        log: record that a piece is from.
        start_s: time at which a piece starts [s].
        effort: whether the effort was logged, for every piece.
        noise: white noise of angle [rad] and effort [N·m] per step of the grid.
        slide: whether the joint moves along a line: units are m and N.
        friction_speed: speed below which the joint may be at rest.
        torque_scale, speed_scale, angle_scale, acc_scale: sizes that occur.
    """

    joint: str
    track: Track
    dt: float
    valid: Bool[np.ndarray, "m p"]
    moving: Bool[np.ndarray, "m p"]
    doubt: Float[np.ndarray, "2 m p"]
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
    acc_scale: float


SETTLE_S = 0.4
"""Time in which a joint follows a target that nobody has seen [s]."""

REST = 0.05
"""Share of a joint's large speeds below which it is at rest."""


def all_tracks(logs: Sequence[MeasuredLog], mechanism: Mechanism) -> list[JointTrack]:
    """Returns the tracks of all joints that are in the records.

    Raises:
        InputError: joints that the mechanism lacks, or no piece that is long enough.
    """
    joints = logs[0].header.joints
    for log in logs:
        if log.header.joints != joints:
            found, valid = ", ".join(log.header.joints), ", ".join(joints)
            raise InputError(log.source, "joints", found, f"as before: {valid}")
        if log.header.mounting != "palm_fixed":
            valid = "palm_fixed: a hand that walks is not diagnosed joint by joint"
            raise InputError(log.source, "mounting", log.header.mounting, valid)
    for joint in joints:
        if joint not in mechanism.drives:
            valid = one_of(mechanism.drives, joint)
            raise InputError(logs[0].source, "joints", joint, valid)
    check_records(logs, mechanism)
    step_s = grid_step_s(logs, joints)
    drives = {joint: mechanism.drives[joint] for joint in joints}
    pieces = [
        p for i, log in enumerate(logs) for p in pieces_of(log, i, drives, step_s)
    ]
    if not pieces:
        longest = max(float(np.ptp(log.t_s)) for log in logs)
        valid = "at least 1.5 s of readings without a jump of the clock"
        raise InputError(logs[0].source, "t", f"{longest:.3g} s in pieces", valid)
    pulls = [mount_gravity(mechanism, log.header.palm_quat_w) for log in logs]
    bodies = [
        bodies_along(mechanism, joints, JointMotion(p.pos, p.vel, p.acc), pulls[p.log])
        for p in pieces
    ]
    return [
        _track(mechanism, logs, pieces, bodies, j, step_s) for j in range(len(joints))
    ]


def _track(mechanism, logs, pieces, bodies, j, step_s) -> JointTrack:
    """Gathers one joint of all pieces."""
    joint = logs[0].header.joints[j]
    drive = mechanism.drives[joint]
    steps = max(len(p.t_s) for p in pieces)
    scale = drive.effort_scale.value

    def stack(values):
        padded = [np.pad(v, [(0, steps - len(v))] + [(0, 0)] * (v.ndim - 1), "edge")
                  for v in values]  # fmt: skip
        return np.stack(padded, 1)

    efforts = [scale * p.effort[:, j] for p in pieces]
    logged = np.array([not np.any(np.isnan(e)) for e in efforts])
    slow = [smoothed(p.vel[:, j], BAND_STEPS) for p in pieces]
    nm = [np.nan_to_num(scale * p.effort) for p in pieces]
    # Of noise about zero the size is not zero: joints at rest would weigh on a supply.
    calm = [np.stack([smoothed(x, BAND_STEPS) for x in e.T], 1) for e in nm]
    joints = logs[0].header.joints
    beside = neighbours(mechanism.model, joints, j)
    pulls = {
        joints[k]: np.stack(
            [stack([p.pos[:, k] for p in pieces]), stack([e[:, k] for e in nm])]
        )
        for k in beside
    }
    other = joints[beside[0]]
    factor = [
        logs[p.log].header.settings.get(drive.kp_setting, 1.0)
        if drive.kp_setting
        else 1.0
        for p in pieces
    ]
    fields = dict(
        cmd=stack([p.cmd[:, j] for p in pieces]),
        held=np.moveaxis(stack(_alike([p.held[:, :, j] for p in pieces])), 1, 2),
        sent=np.moveaxis(stack(_alike([p.sent[:, :, j] for p in pieces])), 1, 2),
        pos=stack([p.pos[:, j] for p in pieces]),
        vel=stack([p.vel[:, j] for p in pieces]),
        acc=stack([p.acc[:, j] for p in pieces]),
        jerk=stack([np.gradient(p.acc[:, j], step_s) for p in pieces]),
        slow_vel=stack(slow),
        effort=stack([np.nan_to_num(e) for e in efforts]),
        push=stack([b.push[:, j] for b in bodies]),
        ext=stack([p.ext[:, j] for p in pieces]),
        inertia=stack([b.inertia[:, j] for b in bodies]),
        moment=stack([b.moment[:, j] for b in bodies]),
        turned=stack([b.turned[:, j] for b in bodies]),
        payload_moment=stack([b.payload_moment[:, j] for b in bodies]),
        payload_shift=stack([b.payload_shift[:, j] for b in bodies]),
        payload_inertia=stack([b.payload_inertia[:, j] for b in bodies]),
        others_nm=stack([np.abs(e).sum(1) - np.abs(e[:, j]) for e in calm]),
        other_q=pulls[other][0],
        other_nm=pulls[other][1],
        gravity=np.stack([b.gravity for b in bodies]),
        payload_kg=np.array([b.payload_kg[j] for b in bodies]),
        kp=drive.kp.value * np.array(factor),
        kd=drive.kd.value * np.ones(len(pieces)),
        measured=logged.astype(float),
        between=np.array(float(_between(drive, pieces[0].every))),
        noise=np.zeros((2, 4)),
    )
    rows = sample_rows(steps)
    valid = np.stack([_valid(p, j, steps) for p in pieces], 1)[rows]
    noise = _noise(logs, joint, drive, step_s)
    torque = np.concatenate(
        [e if ok else drive.kp.value * f * (p.cmd[:, j] - p.pos[:, j])
         for e, ok, p, f in zip(efforts, logged, pieces, factor, strict=True)]
    )  # fmt: skip
    vel = np.concatenate(slow)
    speed = float(np.percentile(np.abs(vel), 98))
    loud = band_noise(noise, step_s)
    fields["noise"] = np.stack([loud, loud])
    at_rest = max(4.0 * loud[1], 0.01 * speed, 1e-9)
    return JointTrack(
        joint=joint,
        track=Track(**{k: jnp.asarray(v, jnp.float32) for k, v in fields.items()}),
        dt=step_s,
        valid=valid,
        moving=np.abs(fields["slow_vel"])[rows] > at_rest,
        doubt=_doubt(fields, drive, step_s, rows),
        other=other,
        neighbours=pulls,
        armature=float(
            mechanism.model.dof_armature[mechanism.model.joint(joint).dofadr[0]]
        ),
        log=np.array([p.log for p in pieces]),
        start_s=np.array([p.t_s[0] for p in pieces]),
        effort=logged,
        noise=noise,
        friction_speed=at_rest,
        slide=mechanism.is_slide(joint),
        torque_scale=max(float(np.percentile(np.abs(torque), 98)), 1e-9),
        speed_scale=max(speed, 1e-9),
        angle_scale=max(
            float(np.ptp(np.concatenate([p.pos[:, j] for p in pieces]))), 1e-9
        ),
        acc_scale=max(
            float(
                np.percentile(np.abs(np.concatenate([p.acc[:, j] for p in pieces])), 98)
            ),
            1e-9,
        ),
    )


def _alike(targets: list[np.ndarray]) -> list[np.ndarray]:
    """Repeats the oldest target where a record of another rate has more of them."""
    most = max(x.shape[1] for x in targets)
    return [np.pad(x, [(0, 0), (most - x.shape[1], 0)], "edge") for x in targets]


def neighbours(model, joints: tuple[str, ...], j: int) -> list[int]:
    """Returns the joints on the parent's body and on its children; else itself."""
    body = [int(model.jnt_bodyid[model.joint(n).id]) for n in joints]
    parents = [int(model.body_parentid[b]) for b in body]
    before = [k for k, other in enumerate(body) if other == parents[j]]
    behind = [k for k, parent in enumerate(parents) if parent == body[j]]
    return before + behind or [j]


def _between(drive: JointDrive, every: int) -> bool:
    """Tells whether the ripple of the command hides between the readings.

    Without a low-pass it jumps, and nobody knows whether a reading comes before a jump
    or after it.
    """
    cutoff = drive.parameter("lowpass_cutoff", "cutoff_hz", np.inf)
    return every == 1 and drive.known == "both" and bool(np.isfinite(cutoff))


def _doubt(track: dict, drive, dt: float, rows: np.ndarray) -> np.ndarray:
    """Returns the doubt about both residuals (controller, mechanics)."""
    measured = track["measured"] > 0.0
    error = track["cmd"] - track["pos"]
    servo = track["kp"] * error - track["kd"] * track["vel"]
    fast = sampling_doubt(np.where(measured, track["effort"], servo))
    late = timing_doubt(track["cmd"], track["vel"], track["kp"], drive, dt)
    both = np.hypot(fast, late)
    return np.stack([both, np.where(measured, fast, both)])[:, rows]


def _valid(piece: Piece, j: int, steps: int) -> np.ndarray:
    """Tells where samples of the residual rest on readings only."""
    valid = np.zeros(steps, bool)
    valid[: len(piece.t_s)] = piece.valid[:, j]
    settle = int(SETTLE_S / (piece.t_s[1] - piece.t_s[0])) + 8
    bad = ~valid
    bad[:settle] = True  # the past of the target is not known
    spread = np.convolve(bad, np.ones(17), "same") > 0
    return ~spread & _resolved(piece, j, steps)


def _resolved(piece: Piece, j: int, steps: int) -> np.ndarray:
    """Tells where the rows are close enough together for what happens.

    Of a motion that lasts a few rows only the rests before and after it count: the
    joint is at rest and has been told nothing new for `SETTLE_S`.
    """
    resolved = np.ones(steps, bool)
    if piece.row_s > SLOW_S:
        settle = int(SETTLE_S / (piece.t_s[1] - piece.t_s[0]))
        told = np.diff(piece.cmd[:, j], prepend=piece.cmd[0, j]) != 0.0
        speed = np.abs(piece.vel[:, j])
        moves = speed > REST * np.percentile(speed, 98)
        busy = np.convolve(told, np.ones(2 * settle + 1), "same")
        busy += np.convolve(moves, np.ones(2 * FINER + 1), "same")
        resolved[: len(busy)] = busy == 0
    return resolved


def _noise(logs, joint: str, drive, step_s: float) -> tuple[float, float]:
    """Estimates the noise of angle and effort, as white noise of one step of the grid.

    Fourth differences of the readings hold little else than noise.
    """
    found = []
    for name in (f"pos.{joint}", f"{drive.effort}.{joint}"):
        kept = [log.samples(name) for log in logs if name in log.columns]
        rough = [_rough(t_s, x, step_s) for t_s, x in kept]
        found.append(float(np.median(rough)) if rough else 0.0)
    return found[0], found[1] * drive.effort_scale.value


def _rough(t_s: np.ndarray, x: np.ndarray, step_s: float) -> float:
    """Deviation of the noise of readings, scaled to a step of the grid.

    The quieter parts of a record count, in which fast motion adds nothing.
    """
    period = float(np.median(np.diff(t_s)))
    d = np.abs(np.diff(x, 4)) / np.sqrt(70.0)
    size = float(np.quantile(d, 0.3)) / 0.3853
    if size == 0.0:  # many readings repeat the last one: a coarse encoder
        size = float(np.sqrt(np.mean(d**2)))
    return size * np.sqrt(min(period / step_s, 1.0))


def band_noise(
    noise: tuple[float, float], step_s: float, whitening: Sequence[float] = ()
) -> Float[np.ndarray, "4"]:
    """Noise in the band of the residuals: angle, speed, acceleration, effort.

    White noise of variance σ² in every step h passes a Gaussian of width w, k
    derivatives, and the filter that makes a residual's noise white:

        σ_k² = (σ² h / π) ∫₀^{π/h} ω²ᵏ exp(−(ω w h)²) |1 − Σ a_n e^{−iω n E h}|² dω

    Args:
        noise: deviations of angle and effort at the steps of the grid.
        step_s: h [s].
        whitening: a_n, at every E-th step.
    """
    w = np.hypot(BAND_STEPS, SMOOTH_STEPS)
    omega = np.linspace(0.0, np.pi, 513)
    lags = EVERY * np.arange(1, len(whitening) + 1)
    passed = 1.0 - np.exp(-1j * np.outer(omega, lags)) @ np.asarray(whitening, float)
    power = np.exp(-((omega * w) ** 2)) * np.abs(passed) ** 2
    size = [np.sqrt(np.trapezoid(omega**k * power, omega) / np.pi) for k in (0, 2, 4)]
    angle, speed, acc = noise[0] * np.array(size) / step_s ** np.arange(3)
    return np.array([angle, speed, acc, noise[1] * size[0]])
