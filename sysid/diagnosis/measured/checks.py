"""Refuses records whose values cannot be what their names say."""

from collections.abc import Sequence

import numpy as np

from envs.errors import InputError
from sysid.drive import EFFORTS, JointDrive
from sysid.logs.log import MeasuredLog
from sysid.mechanism import Mechanism

BEYOND_RAD = 0.5
"""Angle beyond a joint's range that no encoder offset explains [rad]."""

LIKE = 0.9
"""Correlation above which an angle follows a target."""

UNLIKE = 0.5
"""Correlation with its own target below which it does not follow that one."""

FURTHEST_S = 0.5
"""Rows further apart than this show nothing of a servo, not even its rests [s]."""

SHIFTS = 12
"""Lags that are tried: up to about half a second."""


def check_records(logs: Sequence[MeasuredLog], mechanism: Mechanism) -> None:
    """Checks units and names.

    Raises:
        InputError: angles far outside of a joint's range, as degrees are; times in
            milliseconds; an angle that follows the target of another joint; or a
            setting or an effort that `drive.yaml` names and a record lacks.
    """
    for log in logs:
        for joint in log.header.joints:
            _check_setting(log, mechanism.drives[joint])
    for joint in logs[0].header.joints:
        _check_effort(logs, joint, mechanism.drives[joint])
    for log in logs:
        for joint in log.header.joints:
            _check_rate(log, joint)
            _check_range(log, joint, mechanism)
        if len(log.header.joints) > 1:
            _check_names(log)


def _check_setting(log: MeasuredLog, drive: JointDrive) -> None:
    """Refuses a record without the setting that multiplies a gain."""
    name, settings = drive.kp_setting, log.header.settings
    if name and name not in settings:
        valid = f"{name}, the kp_setting of drive.yaml"
        raise InputError(log.source, "settings", ", ".join(settings) or "none", valid)


def _check_effort(logs: Sequence[MeasuredLog], joint: str, drive: JointDrive) -> None:
    """Refuses an effort in a column that no record has.

    Without any torque a record is one without effort, since that is what is read if
    `drive.yaml` says nothing.
    """
    there = [e for e in EFFORTS if any(f"{e}.{joint}" in log.columns for log in logs)]
    asked = drive.effort
    if asked in ("none", *there) or (asked == EFFORTS[0] and not there):
        return
    valid = " or ".join([*(f"effort: {e}" for e in there), "effort: none"])
    raise InputError(logs[0].source, f"{asked}.{joint}", "no such column", valid)


def _check_rate(log: MeasuredLog, joint: str) -> None:
    """Refuses times that can hardly be seconds."""
    found = log.timing(f"pos.{joint}")
    period_s = found.period_s
    if period_s > FURTHEST_S and not found.backward.size:
        valid = f"at most {FURTHEST_S:g} s (is t in milliseconds?)"
        raise InputError(log.source, "t", f"rows {period_s:.4g} s apart", valid)


def _check_range(log: MeasuredLog, joint: str, mechanism: Mechanism) -> None:
    """Refuses angles that the joint cannot have."""
    found = mechanism.model.joint(joint)
    if mechanism.is_slide(joint) or not mechanism.model.jnt_limited[found.id]:
        return
    low, high = (float(x) for x in mechanism.model.jnt_range[found.id])
    for name in (f"pos.{joint}", f"cmd.{joint}"):
        _, values = log.samples(name)
        if not values.size:
            continue
        least, most = float(values.min()), float(values.max())
        if least < low - BEYOND_RAD or most > high + BEYOND_RAD:
            valid = f"the range of the joint, {low:.3g} to {high:.3g} rad"
            raise InputError(log.source, name, f"{least:.3g} to {most:.3g}", valid)


def _check_names(log: MeasuredLog) -> None:
    """Refuses angles that follow another joint's target and not their own."""
    joints = log.header.joints
    targets = [_even(log, f"cmd.{joint}") for joint in joints]
    angles = [_even(log, f"pos.{joint}") for joint in joints]
    for k, angle in enumerate(angles):
        likeness = [_likeness(target, angle) for target in targets]
        other = int(np.argmax(likeness))
        own = likeness[k]
        if targets[k].std() > 0.0 and likeness[other] > LIKE and own < UNLIKE:
            found = f"an angle that follows cmd.{joints[other]}"
            valid = f"one that follows cmd.{joints[k]}"
            raise InputError(log.source, f"pos.{joints[k]}", found, valid)


def _even(log: MeasuredLog, name: str) -> np.ndarray:
    """Returns a column at even times, twenty a second at most, without its mean."""
    t_s, values = log.samples(name)
    if len(t_s) < 2:
        return np.zeros(2)
    order = np.argsort(t_s, kind="stable")
    count = int(min(20.0 * np.ptp(t_s), 20_000.0)) + 2
    grid = np.linspace(t_s.min(), t_s.max(), count)
    x = np.interp(grid, t_s[order], values[order])
    return x - x.mean()


def _likeness(target: np.ndarray, angle: np.ndarray) -> float:
    """Returns the largest correlation over some lags, 0 where one of them rests."""
    best = 0.0
    for lag in range(SHIFTS):
        n = min(len(target), len(angle)) - lag
        if n < 8:
            break
        x, y = target[:n], angle[lag : lag + n]
        size = float(np.sqrt(np.sum(x**2) * np.sum(y**2)))
        if size > 1e-9:
            best = max(best, float(np.sum(x * y)) / size)
    return best
