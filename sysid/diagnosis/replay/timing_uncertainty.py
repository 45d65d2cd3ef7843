"""What the sampling of a record and the servo's own cycle may hide [N·m].

Both make a residual uncertain where much happens at once: its samples count less there.
"""

import numpy as np
from jaxtyping import Float

from sysid.mechanism import JointDrive

SAMPLING = 0.15
"""Share of a torque's fast changes that may be an artefact of sampling."""

CYCLE_S = 2e-4
"""Deviation of the time at which a target is taken: a servo of 1 kHz looks for a new
one every millisecond [s]."""

Array = Float[np.ndarray, "t p"]


def sampling_doubt(torque: Array) -> Array:
    """Returns what may be lost of a torque that changes faster than it is sampled.

    Args:
        torque: at the steps of the grid [N·m].
    """
    fast = np.diff(torque, 2, axis=0, prepend=torque[:1], append=torque[-1:])
    mean = [np.convolve(x, np.ones(9) / 9.0, "same") for x in (fast**2).T]
    return SAMPLING * np.sqrt(np.stack(mean, 1))


def timing_doubt(
    cmd: Array, vel: Array, kp: Float[np.ndarray, " p"], drive: JointDrive, dt: float
) -> Array:
    """Returns how far the servo's torque may be off because of when targets are taken.

    A target that is taken Δ later moves the command by Δ ċ. The changes δ_i of the
    target are taken at times of their own, so

        σ² = (kp Δ)² Σ_i (δ_i ω e^{−ω (t − t_i)})²

    behind a low-pass of cutoff ω, and at most kp Δ v where the speed is limited to v.

    Args:
        cmd: target at the steps of the grid.
        vel: measured speed there.
        kp: gain of the pieces.
        drive: the simulation as it stands.
        dt: step of the grid [s].
    """
    cutoff = drive.parameter("lowpass_cutoff", "cutoff_hz", np.inf)
    speed = drive.parameter("slew_limit", "speed_rad_s", np.inf)
    omega = min(2.0 * np.pi * cutoff, 0.5 / dt)
    change = np.diff(cmd, axis=0, prepend=cmd[:1]) ** 2
    lag = round(drive.parameter("transport_delay", "delay_s", 0.0) / dt)
    change = np.concatenate([np.zeros((lag, cmd.shape[1])), change])[: len(cmd)]
    total, rate = np.zeros(cmd.shape[1]), np.zeros_like(cmd)
    for k, added in enumerate(change):
        total = total * np.exp(-2.0 * omega * dt) + added
        rate[k] = omega * np.sqrt(total)
    rate = np.where(np.abs(vel) > 0.8 * speed, speed, np.minimum(rate, speed))
    return kp * CYCLE_S * rate
