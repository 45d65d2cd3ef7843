"""From the records of a mechanism to the measured track of one of its joints."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import jax.numpy as jnp
import numpy as np

from envs.errors import InputError, one_of
from sysid.diagnosis.measured.checks import check_records
from sysid.diagnosis.measured.in_time import Sensor, in_time
from sysid.diagnosis.measured.resampling import smoothed
from sysid.diagnosis.measured.segments import Piece, grid_step_s, pieces_of
from sysid.diagnosis.replay.band import BAND_STEPS, sample_rows
from sysid.diagnosis.replay.cascade import cascade_of
from sysid.diagnosis.replay.motion import JointTrack, Track
from sysid.diagnosis.replay.neighbours import pulling
from sysid.diagnosis.replay.noise import band_noise, reading_noise
from sysid.diagnosis.replay.timing_uncertainty import (
    push_uncertainty,
    residual_uncertainty,
)
from sysid.diagnosis.replay.validity import begins_anew, supported
from sysid.drive import JointDrive
from sysid.logs.log import MeasuredLog
from sysid.mechanism import Mechanism
from sysid.rigid import Bodies, JointMotion, bodies_along, mount_gravity

_RIGID = (
    *("push", "inertia", "moment", "axis"),
    *("payload_moment", "payload_shift", "payload_inertia", "payload_push"),
)
"""Fields of the motion that come from the rigid bodies."""


def all_tracks(
    logs: Sequence[MeasuredLog],
    mechanism: Mechanism,
    sensors: Mapping[str, Sensor] = MappingProxyType({}),
) -> list[JointTrack]:
    """Returns the tracks of all joints that are in the records.

    Args:
        logs: the records.
        mechanism: the nominal simulation.
        sensors: of joints that stand, for the others, where they were when read.

    Raises:
        InputError: joints that the mechanism lacks, or no piece that is long enough.
    """
    pieces, bodies, step_s = measured_pieces(logs, mechanism, sensors)
    return [
        _track(_Joint(mechanism, logs, pieces, bodies, step_s, j))
        for j in range(len(logs[0].header.joints))
    ]


def measured_pieces(
    logs: Sequence[MeasuredLog],
    mechanism: Mechanism,
    sensors: Mapping[str, Sensor] = MappingProxyType({}),
) -> tuple[list[Piece], list[Bodies], float]:
    """Puts records on a common grid: pieces, what bodies do in them, and the step [s].

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
    pieces = in_time(pieces, joints, sensors)
    pulls = [mount_gravity(mechanism, log.header.palm_quat_w) for log in logs]
    bodies = [
        bodies_along(mechanism, joints, JointMotion(p.pos, p.vel, p.acc), pulls[p.log])
        for p in pieces
    ]
    return pieces, bodies, step_s


@dataclass(frozen=True, eq=False)
class _Joint:
    """One joint (number j) in all pieces of the records."""

    mechanism: Mechanism
    logs: Sequence[MeasuredLog]
    pieces: list[Piece]
    bodies: list[Bodies]
    step_s: float
    j: int

    @property
    def name(self) -> str:
        return self.logs[0].header.joints[self.j]

    @property
    def drive(self) -> JointDrive:
        return self.mechanism.drives[self.name]

    def stacked(self, values: Sequence[np.ndarray]) -> np.ndarray:
        """Pads the pieces to one length with their last value."""
        steps = max(len(p.t_s) for p in self.pieces)
        padded = [np.pad(v, [(0, steps - len(v))] + [(0, 0)] * (v.ndim - 1), "edge")
                  for v in values]  # fmt: skip
        return np.stack(padded, 1)

    def column(self, field: str) -> np.ndarray:
        """Stacks a field of the pieces."""
        return self.stacked([getattr(p, field)[:, self.j] for p in self.pieces])

    def body(self, field: str) -> np.ndarray:
        """Stacks a field of the rigid bodies."""
        return self.stacked([getattr(b, field)[:, self.j] for b in self.bodies])

    def others_read(self) -> np.ndarray:
        """Whether all other joints were read."""
        others = [np.delete(p.valid, self.j, 1) for p in self.pieces]
        return self.stacked([np.all(valid, axis=1) for valid in others])

    def efforts(self) -> list[np.ndarray]:
        """Torques of the drive in all pieces [N·m]; NaN where not logged."""
        return [
            self.drive.effort_scale.value * p.effort[:, self.j] for p in self.pieces
        ]

    def all_efforts(self) -> list[np.ndarray]:
        """Torques of all joints [N·m], each by its own scale; zero where not logged."""
        drives = [self.mechanism.drives[n] for n in self.logs[0].header.joints]
        scale = np.array([drive.effort_scale.value for drive in drives])
        return [np.nan_to_num(scale * p.effort) for p in self.pieces]

    def slow_speeds(self) -> list[np.ndarray]:
        """Speeds that passed the band of the residuals."""
        return [smoothed(p.vel[:, self.j], BAND_STEPS) for p in self.pieces]

    def gain_factors(self) -> list[float]:
        """Factors of kp that the headers of the records set."""
        name = self.drive.kp_setting
        settings = [self.logs[p.log].header.settings for p in self.pieces]
        return [s.get(name, 1.0) if name else 1.0 for s in settings]


def _track(one: _Joint) -> JointTrack:
    """Gathers one joint of all pieces."""
    drive, step_s, pieces = one.drive, one.step_s, one.pieces
    logged = np.array([not np.any(np.isnan(e)) for e in one.efforts()])
    pulls = _neighbour_pulls(one)
    other = next(iter(pulls))
    noise = reading_noise(one.logs, one.name, drive, step_s)
    in_band = band_noise(noise, step_s)
    fields = (
        _motion(one, pulls[other])
        | _commands(one)
        | _constants(one, logged)
        | {"noise": np.stack([in_band, in_band])}
    )
    fields["resumed"] = begins_anew(drive, fields["resumed"], step_s)
    speed = float(np.percentile(np.abs(np.concatenate(one.slow_speeds())), 98))
    at_rest = max(4.0 * in_band[1], 0.01 * speed, 1e-9)
    steps = len(fields["cmd"])
    rows = sample_rows(steps)
    dof = one.mechanism.model.joint(one.name).dofadr[0]
    return JointTrack(
        joint=one.name,
        track=Track(
            cascade=cascade_of(drive, fields, logged),
            **{k: jnp.asarray(v, jnp.float32) for k, v in fields.items()},
        ),
        dt=step_s,
        valid=np.stack([supported(p, one.j, steps) for p in pieces], 1)[rows],
        moving=np.abs(fields["slow_vel"])[rows] > at_rest,
        uncertainty=residual_uncertainty(fields, drive, step_s)[:, rows],
        pushed=push_uncertainty(fields["push"], one.others_read(), step_s),
        unread=one.column("unread"),
        other=other,
        neighbours=pulls,
        armature=float(one.mechanism.model.dof_armature[dof]),
        log=np.array([p.log for p in pieces]),
        start_s=np.array([p.t_s[0] for p in pieces]),
        effort=logged,
        noise=noise,
        friction_speed=at_rest,
        slide=one.mechanism.is_slide(one.name),
        torque_scale=max(_large_torque(one, logged), 1e-9),
        speed_scale=max(speed, 1e-9),
        angle_scale=max(
            float(np.ptp(np.concatenate([p.pos[:, one.j] for p in pieces]))), 1e-9
        ),
    )


def _motion(one: _Joint, pull: np.ndarray) -> dict[str, np.ndarray]:
    """Fields of `Motion`; `pull` is angle and torque of the neighbour."""
    jerk = [np.gradient(p.acc[:, one.j], one.step_s) for p in one.pieces]
    # The mean size of noise is not zero: joints at rest would load the supply.
    calm = [
        np.stack([smoothed(x, BAND_STEPS) for x in e.T], 1) for e in one.all_efforts()
    ]
    measured = {name: one.column(name) for name in ("pos", "vel", "acc", "ext")}
    rigid = {name: one.body(name) for name in _RIGID}
    return (
        measured
        | rigid
        | {
            "jerk": one.stacked(jerk),
            "slow_vel": one.stacked(one.slow_speeds()),
            "effort": one.stacked([np.nan_to_num(e) for e in one.efforts()]),
            "others_nm": one.stacked(
                [np.abs(e).sum(1) - np.abs(e[:, one.j]) for e in calm]
            ),
            "other_q": pull[0],
            "other_nm": pull[1],
        }
    )


def _commands(one: _Joint) -> dict[str, np.ndarray]:
    """Target of all steps, the last targets with their times, and where they resume."""
    last = {
        name: one.stacked(_alike([getattr(p, name)[:, :, one.j] for p in one.pieces]))
        for name in ("held", "sent")
    }
    moved = {name: np.moveaxis(value, 1, 2) for name, value in last.items()}
    return {name: one.column(name) for name in ("cmd", "resumed")} | moved


def _constants(one: _Joint, logged: np.ndarray) -> dict[str, np.ndarray]:
    """What a piece has once."""
    drive = one.drive
    return {
        "gravity": np.stack([b.gravity for b in one.bodies]),
        "payload_kg": np.array([b.payload_kg[one.j] for b in one.bodies]),
        "kp": drive.kp.value * np.array(one.gain_factors()),
        "kd": drive.kd.value * np.ones(len(one.pieces)),
        "measured": logged.astype(float),
        "between": np.array(float(drive.known == "both")),
    }


def _large_torque(one: _Joint, logged: np.ndarray) -> float:
    """The torque that 2 % of the samples exceed; the servo's where none is logged.

    The servo's is within its limit: it asks for many times that on the way to a target
    that is far away.
    """
    kp, j = one.drive.kp.value, one.j
    most = one.drive.parameter("torque_limit", "limit_nm", np.inf)
    torque = np.concatenate(
        [e if ok else np.clip(kp * f * (p.cmd[:, j] - p.pos[:, j]), -most, most)
         for e, ok, p, f in zip(one.efforts(), logged, one.pieces, one.gain_factors(),
                                strict=True)]
    )  # fmt: skip
    return float(np.percentile(np.abs(torque), 98))


def _neighbour_pulls(one: _Joint) -> dict[str, np.ndarray]:
    """Angle and torque (2, t, p) of the joints that may pull on this one."""
    joints, nm = one.logs[0].header.joints, one.all_efforts()
    return {
        joints[k]: np.stack(
            [
                one.stacked([p.pos[:, k] for p in one.pieces]),
                one.stacked([e[:, k] for e in nm]),
            ]
        )
        for k in pulling(one.mechanism, joints, one.j, one.pieces)
    }


def _alike(targets: list[np.ndarray]) -> list[np.ndarray]:
    """Repeats the oldest target where a record of another rate has more of them."""
    most = max(x.shape[1] for x in targets)
    return [np.pad(x, [(0, 0), (most - x.shape[1], 0)], "edge") for x in targets]
