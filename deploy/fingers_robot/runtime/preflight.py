"""What must hold before a hand may be armed; each check says what it found."""

from dataclasses import dataclass

import numpy as np

from fingers_deploy.manifest import Interface
from fingers_deploy.rotations import gravity, tilt, unrotate
from fingers_robot.reading import DriverInfo, Health, ImuReading, Reading
from fingers_robot.safety.detectors.health import unhealthy
from fingers_robot.safety.detectors.sensors import valid_imu, valid_joints
from fingers_robot.safety.limits import Limits, outside
from fingers_robot.safety.types import Inputs

FRESH_S = 0.040


@dataclass(frozen=True)
class Check:
    """One check of the preflight."""

    name: str
    passed: bool
    found: str


def preflight(
    info: DriverInfo, inputs: Inputs, interface: Interface, limits: Limits, t: float
) -> tuple[Check, ...]:
    """Runs all checks that need no power.

    Args:
        info: the driver's.
        inputs: newest samples of joints, IMU and health.
        interface: of the policy.
        limits: of the supervisor.
        t: monotonic time [s].
    """
    reading, imu, health = inputs.reading, inputs.imu, inputs.health
    checks = [
        _joints(info, interface),
        _filter(info, interface),
        _fresh("joint angles", reading, t, FRESH_S),
        _fresh("IMU", imu, t, FRESH_S),
        _fresh("health", health, t, limits.health_age_s),
    ]
    if health is not None:
        problems = unhealthy(health, limits)
        words = "; ".join(problems) or f"{health.bus_v:.1f} V, no error"
        checks.append(Check("healthy", not problems, words))
        checks.append(Check("power off", health.disabled, _power(health)))
    if reading is not None:
        checks.append(_pose(reading, limits))
    if reading is not None and health is not None:
        checks.append(_agreement(reading, health, limits))
    if imu is not None:
        checks.append(_upright(imu, limits))
    return tuple(checks)


def _joints(info: DriverInfo, interface: Interface) -> Check:
    pairs = zip(info.joint_names, interface.joint_names, strict=False)
    wrong = [f"{mine} for {theirs}" for mine, theirs in pairs if mine != theirs]
    same = not wrong and len(info.joint_names) == len(interface.joint_names)
    return Check("joint order", same, wrong[0] if wrong else info.name)


def _filter(info: DriverInfo, interface: Interface) -> Check:
    trained = interface.command_path.lowpass_hz
    words = f"low-pass at {info.lowpass_hz} Hz, trained with {trained} Hz"
    return Check("command filter", info.lowpass_hz == trained, words)


def _fresh(
    name: str, sample: Reading | ImuReading | Health | None, t: float, limit_s: float
) -> Check:
    if sample is None:
        return Check(f"{name} fresh", False, "nothing yet")
    age_s = max(t - sample.t_s, 0.0)  # it may have come after the deadline
    return Check(f"{name} fresh", age_s <= limit_s, f"{1e3 * age_s:.0f} ms old")


def _power(health: Health) -> str:
    return "confirmed off" if health.disabled else "not confirmed off"


def _pose(reading: Reading, limits: Limits) -> Check:
    beyond = outside(reading.pos_rad, limits.factory_rad)
    worst = int(beyond.argmax())
    found = f"joint {worst} {beyond[worst]:.3f} rad outside its limits"
    words = found if beyond[worst] > 0 else "every joint inside"
    passed = valid_joints(reading) and bool(beyond[worst] <= limits.joint_margin_rad)
    return Check("pose within limits", passed, words)


def _agreement(reading: Reading, health: Health, limits: Limits) -> Check:
    apart = np.abs(reading.pos_rad - health.pos_rad)
    worst = int(apart.argmax())
    passed = bool(apart[worst] <= limits.agreement_rad)
    words = f"joint {worst} differs by {apart[worst]:.3f} rad"
    return Check("fast and slow angles agree", passed, words)


def _upright(imu: ImuReading, limits: Limits) -> Check:
    if not valid_imu(imu):
        return Check("attitude", False, "no valid orientation")
    roll, pitch = tilt(unrotate(limits.v_quat_b, gravity(imu.quat_w)))
    words = f"roll {np.rad2deg(roll):.0f}°, pitch {np.rad2deg(pitch):.0f}°"
    level = abs(roll) <= limits.max_roll_rad and abs(pitch) <= limits.max_pitch_rad
    # Tasks that start on their side are given much time before a tilt counts.
    return Check("attitude", level or limits.tilt_s > 1.0, words)
