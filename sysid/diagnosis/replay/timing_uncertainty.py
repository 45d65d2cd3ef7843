"""Uncertainty of torques by the sampling of a record and the servo's own cycle [N·m].

Both make a residual uncertain where much happens at once: its samples count less there.
"""

import math
from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from sysid.diagnosis.replay.band import TAPS
from sysid.drive import JointDrive

SAMPLING = 0.15
"""Share of a torque's fast changes that may be an artefact of sampling."""

CYCLE_S = 2e-4
"""Standard deviation of the time at which a target is taken: a servo of 1 kHz looks
for a new one every millisecond [s]."""

UNREAD_STEPS = 8
"""Steps of the grid about a missing reading that rest on it: the band of the residuals
reaches as far [steps]."""

FOLLOWS_S = 0.15
"""Time in which a servo brings back a joint that was pushed [s]."""

FADED = 8.0
"""Time constants after which a change counts no more [1]."""


def sampling_uncertainty(
    torque: Float[np.ndarray, "t p"],
) -> Float[np.ndarray, "t p"]:
    """What may be lost of a torque that changes faster than it is sampled.

        u_t = 0.15 √(Σ_{|k| ≤ 4} (∇² τ_{t+k})² / 9)

    Args:
        torque: τ at the steps of the grid [N·m].

    Returns:
        u ≥ 0 [N·m].

    Source:
        Ours; the share was measured on hidden cases.
    """
    fast = np.diff(torque, 2, axis=0, prepend=torque[:1], append=torque[-1:])
    mean = [np.convolve(x, np.ones(9) / 9.0, "same") for x in (fast**2).T]
    return SAMPLING * np.sqrt(np.stack(mean, 1))


def push_uncertainty(
    push: Float[np.ndarray, "t p"], read: Bool[np.ndarray, "t p"], dt: float
) -> Float[np.ndarray, "t p"]:
    """What may be lost of what other joints push, as they are sampled and read.

        u_t² = u'_t² + max_s (max_{|i| ≤ 8} τ_{s+i} − min_{|i| ≤ 8} τ_{s+i})²

    with u' of `sampling_uncertainty` and the steps t − 0.15 s ≤ s ≤ t within 8 of one
    at which another joint was not read: as long as a push lasts in a servo. Where
    nothing moves there it is known all the same.

    Args:
        push: τ at the steps of the grid, on straight lines where not read [N·m].
        read: whether all other joints were read.
        dt: step of the grid [s].

    Returns:
        u ≥ 0 [N·m].

    Source:
        Ours.
    """
    wide = 2 * UNREAD_STEPS + 1
    span = maximum_filter1d(push, wide, axis=0) - minimum_filter1d(push, wide, axis=0)
    unsure = np.where(maximum_filter1d(~read, wide, axis=0), span, 0.0)
    lasts = max(round(FOLLOWS_S / dt), 1)
    behind = lasts - (lasts + 1) // 2
    later = maximum_filter1d(unsure, lasts + 1, axis=0, origin=behind)
    return np.hypot(sampling_uncertainty(push), later)


def timing_uncertainty(
    cmd: Float[np.ndarray, "t p"],
    vel: Float[np.ndarray, "t p"],
    kp: Float[np.ndarray, " p"],
    drive: JointDrive,
    dt: float,
) -> Float[np.ndarray, "t p"]:
    """How far the servo's torque may be off because of when targets are taken.

    A target that is taken Δ later moves the command by Δ ċ. The changes δ_i of the
    target are taken at times of their own, so

        σ² = (kp Δ)² Σ_i (δ_i r(t − t_i))²,   r = w ∗ a,   a_k = (1 − λ) λᵏ / h

    behind a low-pass of cutoff ω, λ = e^{−ω h}, at steps k of length h, and the band w
    of the residuals, which spreads a change to the samples before it; and at most
    kp Δ v where the speed is limited to v.

    Args:
        cmd: target at the steps of the grid [rad].
        vel: measured speed there [rad/s].
        kp: gain of the pieces [N·m/rad].
        drive: the nominal simulation.
        dt: step of the grid [s].

    Returns:
        σ ≥ 0 [N·m].

    Source:
        Ours; a Poisson sum of the responses of a first-order low-pass.
    """
    cutoff = drive.parameter("lowpass_cutoff", "cutoff_hz", np.inf)
    speed = drive.parameter("slew_limit", "speed_rad_s", np.inf)
    decay = 2.0 * np.pi * cutoff * dt
    change = np.diff(cmd, axis=0, prepend=cmd[:1]) ** 2
    lag = round(drive.parameter("transport_delay", "delay_s", 0.0) / dt)
    change = np.concatenate([np.zeros((lag, cmd.shape[1])), change])[: len(cmd)]
    steps = np.arange(min(len(cmd), 1 + math.ceil(FADED / decay)))
    filtered = -np.expm1(-decay) / dt * np.exp(-decay) ** steps
    response = np.convolve(TAPS, filtered) ** 2
    first = len(TAPS) // 2
    spread = [np.convolve(x, response)[first : first + len(cmd)] for x in change.T]
    rate = np.sqrt(np.stack(spread, 1))
    rate = np.where(np.abs(vel) > 0.8 * speed, speed, np.minimum(rate, speed))
    return kp * CYCLE_S * rate


def residual_uncertainty(
    fields: Mapping[str, np.ndarray], drive: JointDrive, dt: float
) -> Float[np.ndarray, "2 t p"]:
    """Uncertainty of both residuals, by how torques are sampled and targets taken.

        controller  √(u² + σ²),   mechanics  u where an effort is logged, else the same

    with u of `sampling_uncertainty` of the logged effort or the servo's law.

    Args:
        fields: of the track: target, angle, speed, gains and effort.
        drive: the nominal simulation.
        dt: step of the grid [s].

    Returns:
        Of controller and mechanics [N·m].

    Source:
        Ours.
    """
    measured = fields["measured"] > 0.0
    error = fields["cmd"] - fields["pos"]
    servo = fields["kp"] * error - fields["kd"] * fields["vel"]
    fast = sampling_uncertainty(np.where(measured, fields["effort"], servo))
    late = timing_uncertainty(fields["cmd"], fields["vel"], fields["kp"], drive, dt)
    both = np.hypot(fast, late)
    return np.stack([both, np.where(measured, fast, both)])
