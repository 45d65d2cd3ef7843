"""One joint of a log on a fine grid of time: held targets, gravity, readings."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from envs.errors import InputError
from sysid.calibration.held import held_means
from sysid.calibration.neighbours import Neighbours, neighbours_along
from sysid.logs.log import MeasuredLog
from sysid.logs.timing import timing
from sysid.mechanism import Mechanism, rest_posture
from sysid.rigid import at_rest, bodies_along, mount_gravity

STEP_S, BLOCK_S = 0.0005, 1.0
"""With steps of a millisecond fits end up to a tenth off in stiffness, beside delays
that are half a millisecond off; see the results of the calibration."""

_EVERY = 20
_SETTLE_S = 0.5
_LEAST_ROWS = 50


@dataclass(frozen=True, eq=False)
class Record:
    """A joint in one log.

    Attributes:
        t_s: time of every row from the start [s].
        measured: angle [rad] and effort [N·m] of every row; NaN where none was read.
        valid: which readings count: those that exist, but for half a second at the
            start and after every gap, in which targets went out that nobody wrote down.
        held: target at every step [rad].
        load, load_slope: torque of gravity at every step and its change with the angle.
        angle: measured angle at every step [rad].
        neighbours: inertia of the joint, and what moves along with it.
    """

    t_s: Float[np.ndarray, " n"]
    measured: Float[np.ndarray, "n 2"]
    valid: Bool[np.ndarray, "n 2"]
    held: Float[np.ndarray, " m"]
    load: Float[np.ndarray, " m"]
    load_slope: Float[np.ndarray, " m"]
    angle: Float[np.ndarray, " m"]
    neighbours: Neighbours

    def at_rows(self, steps: Float[np.ndarray, "c m k"]) -> Float[np.ndarray, "c n k"]:
        """y(t) = (1 − s) y_a + s y_{a+1} with a + s = t / Δt, at the times of the rows.

        Args:
            steps: simulated angle [rad] and effort [N·m] of candidates at all steps.

        Source:
            Textbook linear interpolation.
        """
        place = np.clip(self.t_s / STEP_S, 0.0, steps.shape[1] - 1.001)
        low = place.astype(int)
        share = (place - low)[:, None]
        return (1.0 - share) * steps[:, low] + share * steps[:, low + 1]


def joint_record(mechanism: Mechanism, log: MeasuredLog, joint: str) -> Record:
    """Prepares one joint of a log.

    Raises:
        InputError: a hand that is not on a stand, times that run backward, or too few
            readings.
    """
    if log.header.mounting != "palm_fixed":
        valid = "palm_fixed: joints are calibrated on a stand"
        raise InputError(log.source, "mounting", log.header.mounting, valid)
    if np.any(np.diff(log.t_s) < 0.0):
        valid = "times that never run backward"
        raise InputError(log.source, "t", "a step back", valid)
    effort = _effort(mechanism, log, joint)
    position = log.column(f"pos.{joint}")
    t_s = log.t_s - log.t_s[0]
    measured = np.stack([position, effort], 1)
    valid = ~np.isnan(measured) & _settled(t_s)[:, None]
    if valid[:, 0].sum() < _LEAST_ROWS:
        found = f"{int(valid[:, 0].sum())} readings after {_SETTLE_S:g} s"
        raise InputError(log.source, f"pos.{joint}", found, f"at least {_LEAST_ROWS}")
    grid = np.arange(int(t_s[-1] / STEP_S) + 2) * STEP_S
    postures = _postures(mechanism, log, grid[::_EVERY])
    pull = mount_gravity(mechanism, log.header.palm_quat_w)
    bodies = bodies_along(mechanism, mechanism.joints, at_rest(postures), pull)
    j = mechanism.joints.index(joint)
    weight, slope = (
        np.interp(grid, grid[::_EVERY], x[:, j])
        for x in (bodies.weight, bodies.weight_slope)
    )
    held = {
        name: _targets(log, f"cmd.{name}", grid)
        if name in log.header.joints
        else np.full(len(grid), angle)
        for name, angle in zip(mechanism.joints, postures[0], strict=True)
    }
    return Record(
        t_s=t_s,
        measured=measured,
        valid=valid,
        held=held[joint],
        load=weight,
        load_slope=slope,
        angle=_between(log, f"pos.{joint}", grid),
        neighbours=neighbours_along(
            mechanism, bodies.matrix, _EVERY, held, joint, STEP_S
        ),
    )


def _settled(t_s: Float[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Returns which rows are long after the start and after the last gap."""
    starts = [t_s[part][0] for part in timing(t_s).parts]
    since = t_s - np.array(starts)[np.searchsorted(starts, t_s, "right") - 1]
    return since > _SETTLE_S


def _effort(mechanism: Mechanism, log: MeasuredLog, joint: str) -> np.ndarray:
    """Returns the effort [N·m], NaN if it was not logged."""
    drive = mechanism.drives[joint]
    name = f"{drive.effort}.{joint}"
    if drive.effort == "none" or name not in log.columns:
        return np.full(len(log), np.nan)
    return drive.effort_scale.value * log.column(name)


def _targets(log: MeasuredLog, name: str, grid: np.ndarray) -> np.ndarray:
    t_s, values = log.samples(name)
    return held_means(t_s - log.t_s[0], values, grid, STEP_S)


def _between(log: MeasuredLog, name: str, grid: np.ndarray) -> np.ndarray:
    t_s, values = log.samples(name)
    return np.interp(grid, t_s - log.t_s[0], values)


def _postures(
    mechanism: Mechanism, log: MeasuredLog, coarse: np.ndarray
) -> Float[np.ndarray, "c j"]:
    """Angles of all joints at some times; those that were not measured rest."""
    postures = np.tile(rest_posture(mechanism), (len(coarse), 1))
    for name in log.header.joints:
        if name not in mechanism.joints:
            valid = f"joints of the mechanism: {', '.join(mechanism.joints)}"
            raise InputError(log.source, "joints", name, valid)
        column = mechanism.joints.index(name)
        postures[:, column] = _between(log, f"pos.{name}", coarse)
    return postures
