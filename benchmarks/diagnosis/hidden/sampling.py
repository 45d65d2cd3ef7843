"""From a hidden motion to the log that a host would have written of it."""

import math
from dataclasses import dataclass

import numpy as np

from benchmarks.diagnosis.hidden.plant import STEP_S
from benchmarks.diagnosis.hidden.recording import Recording
from benchmarks.diagnosis.hidden.simulate import Motion, simulate
from benchmarks.diagnosis.hidden.truth import Mechanism
from sysid.logs.log import MeasuredLog, make_log

FAST_HZ = 250.0
"""Rows in a second above which the physics takes finer steps."""


@dataclass(frozen=True)
class Noise:
    """What stands between a motion and its log.

    Attributes:
        angle_lsb_rad, angle_sd_rad: step of the encoder and white noise.
        torque_lsb_nm, torque_sd_nm: the same of the effort.
        jitter_s: deviation of the host's ticks, which are in the log.
        stamp_s: deviation of a time stamp from when the reading was taken; not logged.
        lost: share of readings that are missing in their rows.
        stalls: pauses of the host, 30 to 60 ms without rows.
        start_rad: deviation of the angle at the beginning from the first target.
    """

    angle_lsb_rad: float = 2.0 * np.pi / 16384
    angle_sd_rad: float = 3e-4
    torque_lsb_nm: float = 1e-3
    torque_sd_nm: float = 4e-3
    jitter_s: float = 1.5e-4
    stamp_s: float = 5e-5
    lost: float = 0.004
    stalls: int = 2
    start_rad: float = 0.02

    def deviations(self, rate_speed: float = 0.0) -> tuple[float, float]:
        """Returns about how much readings of angle and torque scatter."""
        angle = np.hypot(self.angle_sd_rad, self.angle_lsb_rad / np.sqrt(12.0))
        angle = np.hypot(angle, rate_speed * self.stamp_s)
        return angle, np.hypot(self.torque_sd_nm, self.torque_lsb_nm / np.sqrt(12.0))


def ticks(recording: Recording, noise: Noise, rng: np.random.Generator) -> np.ndarray:
    """Times at which the host sends and reads, and pauses [s]."""
    rows = len(recording.targets)
    times = np.arange(rows) / recording.rate_hz
    scatter = rng.normal(0.0, noise.jitter_s, rows)
    times = times + np.clip(scatter, -0.2 / recording.rate_hz, 0.2 / recording.rate_hz)
    return times - times[0]


def exact(
    mechanism: Mechanism, recording: Recording, times: np.ndarray, start=None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles, torques and speeds at the ticks, without any noise (rows by joints)."""
    step_s = step_of(mechanism, recording)
    motion = simulate(mechanism, times, recording.targets, start, step_s)
    angle, torque, speed = (
        _read(mechanism, motion, times, x) for x in _channels(motion)
    )
    return angle, torque, speed


def step_of(mechanism: Mechanism, recording: Recording) -> float:
    """Step of the physics: targets without a low-pass act between two of them [s]."""
    plain = any(math.isinf(joint.lowpass_hz) for joint in mechanism.joints)
    return STEP_S / 4.0 if plain or recording.rate_hz > FAST_HZ else STEP_S


def _channels(motion: Motion):
    return motion.encoder, motion.torque, motion.speed


def _read(mechanism: Mechanism, motion: Motion, times, values) -> np.ndarray:
    """Reads channels at their own age: latency, and a clock that runs too fast."""
    columns = []
    for i, joint in enumerate(mechanism.joints):
        drift = joint.value("clock_drift", "drift", 0.0)
        age = joint.value("sensor_latency", "latency_s", 0.0)
        at = np.clip(times * (1.0 + drift) - age, 0.0, motion.t_s[-1])
        columns.append(np.interp(at, motion.t_s, values[:, i]))
    return np.stack(columns, 1)


def record(
    mechanism: Mechanism,
    recording: Recording,
    noise: Noise,
    rng: np.random.Generator,
    **header,
) -> MeasuredLog:
    """Simulates a recording and writes down what a host would have seen.

    Args:
        mechanism: the truth.
        recording: the targets.
        noise: what the host adds.
        rng: draws it.
        **header: further fields of the log's header.
    """
    times = ticks(recording, noise, rng)
    taken = times + rng.normal(0.0, noise.stamp_s, times.size)
    start = recording.targets[0] + rng.normal(0.0, noise.start_rad, 1)
    step_s = step_of(mechanism, recording)
    motion = simulate(mechanism, times, recording.targets, start, step_s)
    angle, torque, _ = (_read(mechanism, motion, taken, x) for x in _channels(motion))
    shape = angle.shape
    lost = rng.random(shape) < noise.lost
    angle = angle + rng.normal(0.0, noise.angle_sd_rad, shape)
    torque = torque + rng.normal(0.0, noise.torque_sd_nm, shape)
    values = {
        "pos": _rounded(angle, noise.angle_lsb_rad),
        "tau": _rounded(torque, noise.torque_lsb_nm),
    }
    kept = _without_stalls(times, noise, rng)
    names = tuple(link.name for link in mechanism.links)
    columns = {}
    for i, name in enumerate(names):
        columns[f"cmd.{name}"] = recording.targets[kept, i]
        for quantity, x in values.items():
            columns[f"{quantity}.{name}"] = np.where(lost[:, i], np.nan, x[:, i])[kept]
    return make_log(names, times[kept], columns, **header)


def _rounded(values: np.ndarray, lsb: float) -> np.ndarray:
    return np.round(values / lsb) * lsb if lsb > 0.0 else values


def _without_stalls(times, noise: Noise, rng) -> np.ndarray:
    """Rows that were written: a pause loses some, although targets went out."""
    kept = np.ones(times.size, dtype=bool)
    for _ in range(noise.stalls):
        first = rng.uniform(0.05, 0.9) * times[-1]
        kept &= (times < first) | (times > first + rng.uniform(0.03, 0.06))
    return kept
