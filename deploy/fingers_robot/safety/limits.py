"""The numbers behind the safety table, for one bundle on one hand."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from fingers_deploy.errors import InputError
from fingers_deploy.manifest import Manifest
from fingers_robot.reading import Array

_NEVER = float("inf")

# Tilt of V against level that trips, and for how long it must last. Crawling may not
# tilt further than in training, where it ended the episode; recovery starts on its side
# and is only stopped when it makes no progress.
TILT = {
    "crawl": (35.0, 30.0, 0.1),
    "push": (35.0, 30.0, 0.1),
    "keyboard": (15.0, 15.0, 0.1),
    "recovery": (35.0, 30.0, 10.0),
}

# A hand that gets up leans on joints at their stops, which give under its weight: by up
# to 0.12 rad in simulation.
RECOVERY_JOINT_MARGIN_RAD = 0.15


@dataclass(frozen=True)
class Limits:
    """Limits and times of the supervisor; see `fingers_robot.safety.table`.

    Attributes:
        trained_rad: joint limits of the manifest, [20, 2].
        factory_rad: limits that the hand reports, [20, 2].
        allowed_rad: trained ∩ factory, [20, 2].
        target_margin_rad: a proposed target so far outside the trained limits is a
            fault, less is clamped.
        rest_rad: targets at which the settle ramp ends and the policy begins, [20].
        begins_at_pose: the policy begins at the measured pose instead, as a recovery
            does wherever the hand has fallen.
        v_quat_b: orientation of V in the palm frame, w x y z.
        step_rad: largest change of a target per control step.
        control_dt_s: control interval [s].
        max_roll_rad, max_pitch_rad: tilt of V against level that trips.
        tilt_s: how long the tilt must last [s].
        obs_age_s: oldest sample that counts as fresh [s].
        frozen_joints_s: joints bit-identical for so long, while the targets move by
            `frozen_target_rad`, count as frozen [s]; those of one finger, while its
            own targets move by `frozen_finger_rad`.
        frozen_imu_s: the same for the IMU, whatever the targets do [s].
        health_age_s: oldest slow read-back that counts as alive [s].
        effort_limit_a: effort limit that must be set [A].
        over_effort: multiple of it that trips after `over_effort_s` [s].
        stall_effort: multiple of it that trips after `stall_s` [s].
        max_temperature_c: [°C].
        bus_v: lowest and highest supply voltage [V].
        step_tolerance_rad: rounding that a step may exceed α by.
        joint_margin_rad: how far a joint may be outside its factory limits.
        tracking_rad, tracking_s: difference of target and angle that trips when it
            lasts so long.
        lease_s: longest time without a valid answer of the policy [s].
        command_s: longest age of the operator's command [s].
        skipped_ticks: most control steps skipped in a row.
        gap_s: longest time between two steps of the supervisor [s].
        settle_s: duration of the settle ramp [s].
        confirm_s: time for the hand to confirm that it is de-energized [s].
        agreement_rad: largest difference between fast and slow joint angles.
    """

    trained_rad: Array
    factory_rad: Array
    allowed_rad: Array
    rest_rad: Array
    v_quat_b: tuple[float, float, float, float]
    step_rad: float
    control_dt_s: float
    max_roll_rad: float
    max_pitch_rad: float
    tilt_s: float
    begins_at_pose: bool = False
    obs_age_s: float = 0.040
    frozen_joints_s: float = 0.100
    frozen_target_rad: float = 0.02
    frozen_finger_rad: float = 0.1
    frozen_imu_s: float = 0.060
    health_age_s: float = 0.380
    effort_limit_a: float = 1.0
    over_effort: float = 1.05
    over_effort_s: float = 0.020
    stall_effort: float = 0.9
    stall_s: float = 1.0
    max_temperature_c: float = 80.0
    bus_v: tuple[float, float] = (12.0, 17.0)
    target_margin_rad: float = 0.02
    step_tolerance_rad: float = 1e-3
    joint_margin_rad: float = 0.05
    tracking_rad: float = 0.5
    tracking_s: float = 0.5
    lease_s: float = 0.060
    command_s: float = 1.0
    skipped_ticks: int = 3
    gap_s: float = 0.100
    settle_s: float = 1.5
    confirm_s: float = 0.2
    agreement_rad: float = 0.05

    def without_motion(self) -> "Limits":
        """For a dry run: what compares measured motion with targets is off."""
        return dataclasses.replace(self, frozen_joints_s=_NEVER, tracking_s=_NEVER)


def make_limits(manifest: Manifest, factory_rad: Array, **changes: Any) -> Limits:
    """Limits for a bundle on a hand.

    Args:
        manifest: of the policy that begins.
        factory_rad: limits that the hand reports, [20, 2].
        changes: fields of `Limits` to set.

    Raises:
        InputError: trained and factory limits of a joint have nothing in common, the
            task has no tilt limits, or the initial target is outside the limits.
    """
    interface = manifest.interface
    if manifest.task not in TILT:
        raise InputError("manifest", "task", manifest.task, "one of " + ", ".join(TILT))
    roll, pitch, tilt_s = TILT[manifest.task]
    trained = np.asarray(interface.joint_limits_rad, np.float64)
    allowed = intersect(trained, factory_rad, interface.joint_names)
    rest = np.asarray(interface.initial_target_rad, np.float64)
    recovers = manifest.task == "recovery"
    margin = {"joint_margin_rad": RECOVERY_JOINT_MARGIN_RAD} if recovers else {}
    limits = Limits(
        trained_rad=trained,
        factory_rad=factory_rad,
        allowed_rad=allowed,
        rest_rad=np.clip(rest, allowed[:, 0], allowed[:, 1]),
        v_quat_b=interface.v_quat_b,
        step_rad=interface.action.scale_rad,
        control_dt_s=1.0 / interface.control_rate_hz,
        max_roll_rad=float(np.deg2rad(roll)),
        max_pitch_rad=float(np.deg2rad(pitch)),
        tilt_s=tilt_s,
        begins_at_pose=recovers,
    )
    return dataclasses.replace(limits, **(margin | changes))


def intersect(trained: Array, factory: Array, names: tuple[str, ...]) -> Array:
    """Trained limits within the factory's, where the hand itself would clamp, [20, 2].

    Raises:
        InputError: the two have nothing in common for a joint.
    """
    low = np.maximum(trained[:, 0], factory[:, 0])
    high = np.minimum(trained[:, 1], factory[:, 1])
    for i, name in enumerate(names):
        # Written so that NaN is refused as well.
        if not low[i] < high[i]:
            found = f"{factory[i].tolist()} on the hand"
            valid = f"an overlap with the trained {trained[i].tolist()}"
            raise InputError("hand", f"joint limits of {name}", found, valid)
    return np.stack([low, high], axis=1)


def outside(rad: Array, limits: Array) -> Array:
    """max(low − x, x − high): how far outside, negative inside [rad], [20].

    Args:
        rad: angles or targets, [20].
        limits: lowest and highest of each, [20, 2].
    """
    return np.maximum(limits[:, 0] - rad, rad - limits[:, 1])
