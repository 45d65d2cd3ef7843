"""S1 late, S2 frozen, S3 impossible measurements."""

import dataclasses
import math
from dataclasses import dataclass, field

import numpy as np

from fingers_robot.reading import Array, ImuReading, Reading
from fingers_robot.safety.detectors.fingers import FingerMemory, detect_fingers
from fingers_robot.safety.limits import Limits
from fingers_robot.safety.types import Found, Inputs, PolicyFault

MAX_ANGLE_RAD = 7.0  # more than one turn: no joint of a hand gets there
MAX_GYRO_RAD_S = 40.0  # beyond the range of any IMU in use (2000 °/s)
_NORM_TOLERANCE = 0.01


@dataclass(frozen=True, slots=True)
class SensorMemory:
    """When the values last changed.

    Attributes:
        pos_rad: joint angles then; None before the first sample.
        pos_since_s: time of that change [s].
        target_rad: targets at that time.
        quat_w: orientation at the IMU's last change.
        gyro_b: angular velocity then.
        imu_since_s: time of that change [s].
        frozen: the joints were found frozen and have not changed since.
        fingers: the same, finger by finger.
    """

    pos_rad: Array | None = None
    pos_since_s: float = 0.0
    target_rad: Array | None = None
    quat_w: Array | None = None
    gyro_b: Array | None = None
    imu_since_s: float = 0.0
    frozen: bool = False
    fingers: FingerMemory = field(default_factory=FingerMemory)


def detect_sensors(
    memory: SensorMemory, inputs: Inputs, target_rad: Array, t: float, limits: Limits
) -> tuple[SensorMemory, Found]:
    """Looks at the newest samples.

    Args:
        memory: memory after the step before.
        inputs: inputs of this step.
        target_rad: targets on the wire.
        t: monotonic time [s].
        limits: the limits.

    Returns:
        The memory and what was found, by row of the table.
    """
    found: Found = {}
    memory = _remember(memory, inputs, target_rad, t)
    _late(inputs, t, limits, found)
    reading = inputs.reading
    fingers, words = detect_fingers(
        memory.fingers,
        None if reading is None else reading.pos_rad,
        target_rad,
        t,
        limits,
    )
    if words:
        found["S2"] = words
    memory = dataclasses.replace(memory, fingers=fingers)
    memory = _frozen_joints(memory, target_rad, t, limits, found)
    _frozen_imu(memory, t, limits, found)
    _impossible(inputs, found)
    return memory, found


def valid_joints(reading: Reading | None) -> bool:
    """Whether the joint angles may be used: finite and possible."""
    return reading is not None and bool(
        np.abs(reading.pos_rad).max() <= MAX_ANGLE_RAD  # False for NaN
    )


def valid_imu(imu: ImuReading | None) -> bool:
    """Whether orientation and angular velocity may be used."""
    if imu is None:
        return False
    w, x, y, z = imu.quat_w.tolist()
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    return abs(norm - 1.0) <= _NORM_TOLERANCE and bool(
        np.abs(imu.gyro_b).max() <= MAX_GYRO_RAD_S
    )


def _remember(
    memory: SensorMemory, inputs: Inputs, target_rad: Array, t: float
) -> SensorMemory:
    pos, pos_since, target = memory.pos_rad, memory.pos_since_s, memory.target_rad
    frozen = memory.frozen
    reading, imu = inputs.reading, inputs.imu
    if reading is not None and (pos is None or (reading.pos_rad != pos).any()):
        pos, pos_since, target = reading.pos_rad, t, target_rad
        frozen = False
    quat, gyro, imu_since = memory.quat_w, memory.gyro_b, memory.imu_since_s
    if imu is not None and (
        quat is None or (imu.quat_w != quat).any() or (imu.gyro_b != gyro).any()
    ):
        quat, gyro, imu_since = imu.quat_w, imu.gyro_b, t
    return SensorMemory(
        pos, pos_since, target, quat, gyro, imu_since, frozen, memory.fingers
    )


def _late(inputs: Inputs, t: float, limits: Limits, found: Found) -> None:
    for name, sample in (("joints", inputs.reading), ("IMU", inputs.imu)):
        if sample is None:
            found["S1"] = f"no sample of the {name} yet"
        elif t - sample.t_s > limits.obs_age_s:
            found["S1"] = f"{name} {1e3 * (t - sample.t_s):.0f} ms old"


def _frozen_joints(
    memory: SensorMemory, target_rad: Array, t: float, limits: Limits, found: Found
) -> SensorMemory:
    """Once found frozen they stay so until they change, wherever the targets go."""
    age_s = t - memory.pos_since_s
    if memory.target_rad is None or age_s < limits.frozen_joints_s:
        return memory
    moved = np.abs(target_rad - memory.target_rad).max()
    if memory.frozen or moved > limits.frozen_target_rad:
        found["S2"] = f"joints frozen for {1e3 * age_s:.0f} ms while targets moved"
        return dataclasses.replace(memory, frozen=True)
    return memory


def _frozen_imu(memory: SensorMemory, t: float, limits: Limits, found: Found) -> None:
    age_s = t - memory.imu_since_s
    if memory.quat_w is not None and age_s >= limits.frozen_imu_s:
        found["S2"] = f"IMU frozen for {1e3 * age_s:.0f} ms"


def _impossible(inputs: Inputs, found: Found) -> None:
    reading, proposal = inputs.reading, inputs.proposal
    if reading is not None and not valid_joints(reading):
        found["S3"] = "joint angles not finite or impossible"
    elif reading is not None and not np.isfinite(reading.effort_a).all():
        found["S3"] = "efforts not finite"
    elif inputs.imu is not None and not valid_imu(inputs.imu):
        found["S3"] = "IMU not finite, not a unit quaternion, or out of range"
    elif proposal is not None and proposal.fault == PolicyFault.OBSERVATION:
        found["S3"] = "the policy process saw an observation that is not finite"
