"""Stiffness, damping, delay, cutoff and speed of one joint.

The joint is simulated on the recorded targets (`sysid.calibration.simulation`) and its
parameters are moved until angle and, where it was logged, effort agree. Inertia, weight
and both frictions are fitted along within what is known of them, and neighbours move
along, so that they bias nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from envs.errors import InputError
from sysid.calibration.record import Record, joint_record
from sysid.calibration.simulation import SERVO, Motion
from sysid.drive import JointDrive
from sysid.least_squares import Task, fit_all, standard_errors
from sysid.logs.log import MeasuredLog
from sysid.mechanism import Mechanism

PARAMETERS: tuple[str, ...] = (
    "stiffness",
    "damping",
    "delay_s",
    "lowpass_hz",
    "speed_limit",
)
"""What is reported; inertia, weight and both frictions are fitted along."""

_DEVIATION = np.array([2.0, 2.0, 1.5, 1.5, 2.0, 0.05, 0.05, 1.0, 1.0])
"""Of the priors: of logarithms, and of the frictions in units of the largest torque and
of the velocity gain."""

_BESIDE = (
    (-0.2, 0.0),
    (0.2, 0.0),
    (0.0, -0.08),
    (0.0, 0.08),
    (-0.2, -0.08),
    (0.2, 0.08),
)
"""Shifts of the logarithms of stiffness and delay from which a fit begins again."""

_LONGEST_DELAY_S = 0.095
_ROUNDS, _STEP = 30, 0.01

_FLOOR = np.array([0.018, 0.012, 0.012, 0.003, 0.0015])
"""Deviations of the logarithms below which nothing is believed: nobody knows when
within a step the firmware acts, and a quarter of a millisecond biases stiffness by a
percent or more. Neighbours' own gains and forces of rotation are the rest. Over
twenty joints of the second simulator, of the same step, stiffness errs by 0.9 percent
(root mean square); over four of them in steps of an eighth of a millisecond by 3.6."""

_NO_SPEED_LIMIT, _NO_TORQUE_LIMIT = 100.0, 1e6


@dataclass(frozen=True, eq=False)
class JointFit:
    """What was found for one joint.

    Attributes:
        joint: its name.
        values, low, high: by name in `PARAMETERS`; gains as factors of the drive's; NaN
            bounds for what the record does not show.
        rms: error of every channel, `pos` and, if logged, the effort.
        records: what was measured.
        simulated: what the fit gives for it, records of rows by (angle, effort).
    """

    joint: str
    values: dict[str, float]
    low: dict[str, float]
    high: dict[str, float]
    rms: dict[str, float]
    records: tuple[Record, ...]
    simulated: tuple[Float[np.ndarray, "n 2"], ...]

    def deviation(self, name: str) -> float:
        """Returns half the interval's width over 1.96, in the parameter's unit."""
        return (self.high[name] - self.low[name]) / (2.0 * 1.96)


def fit_joint(
    mechanism: Mechanism, logs: Sequence[MeasuredLog], joint: str
) -> JointFit:
    """Fits one joint.

    Raises:
        InputError: the joint does not move in any record.
    """
    records = tuple(joint_record(mechanism, log, joint) for log in logs)
    if max(np.ptp(r.held) for r in records) < 1e-3:
        valid = "targets that move the joint"
        raise InputError(logs[0].source, f"cmd.{joint}", "no motion", valid)
    drive = mechanism.drives[joint]
    limit = drive.parameter("torque_limit", "limit_nm", _NO_TORQUE_LIMIT)
    motion = Motion(records, (drive.kp.value, drive.kd.value), limit)
    theta, half = _solved(motion, _nominal(drive))
    servo = theta[SERVO]
    simulated = tuple(y[0] for y in motion.simulate(theta[None]))
    values, low, high = (
        dict(zip(PARAMETERS, np.exp(x).tolist(), strict=True))
        for x in (servo, servo - half, servo + half)
    )
    rms = _rms(records, simulated)
    return JointFit(joint, values, low, high, rms, records, simulated)


def _solved(
    motion: Motion, nominal: Float[np.ndarray, " 9"]
) -> tuple[Float[np.ndarray, " 9"], Float[np.ndarray, " 5"]]:
    """All parameters, and half the widths of the servo's intervals."""
    starts = _starts(nominal)
    costs = np.sum(np.clip(motion.residuals(starts), -30.0, 30.0) ** 2, 1)
    # A gain far off may start better and end worse.
    near = np.where(starts[:, 0] == nominal[0], costs, np.inf)
    chosen = {int(np.argmin(costs)), int(np.argmin(near))}
    tasks = [_task(starts[i], nominal) for i in chosen]
    fit = min(fit_all(motion.residuals, tasks, _ROUNDS), key=lambda fit: fit.cost)
    for _ in range(2):
        # Once more with channels weighed by what they really scatter.
        motion.weigh(motion.residuals(fit.theta[None])[0])
        again = [replace(tasks[0], start=start) for start in _nearby(fit.theta)]
        fit = min(fit_all(motion.residuals, again, _ROUNDS), key=lambda fit: fit.cost)
    errors, wide = standard_errors(fit, _DEVIATION, motion.blocks())
    return fit.theta, wide * np.hypot(errors[SERVO], _FLOOR)


def _nearby(theta: Float[np.ndarray, " 9"]) -> Float[np.ndarray, "c 9"]:
    """Where a fit ended, and starts beside it.

    Stiffness and delay make up for each other, and the cost has several minima along
    that way.
    """
    shifts = np.zeros((len(_BESIDE) + 1, len(theta)))
    shifts[1:, [0, 2]] = _BESIDE
    return theta + shifts


def _task(start: Float[np.ndarray, " 9"], nominal: Float[np.ndarray, " 9"]) -> Task:
    """The fit of all parameters from a start, with priors around the nominal ones."""
    low, high = np.full(9, -np.inf), np.full(9, np.inf)
    high[2], low[7:] = np.log(_LONGEST_DELAY_S), 0.0
    steps = np.full(9, _STEP)
    # A speed limit and dry friction make the cost rough: with forward differences a fit
    # may stop ten percent away from the least cost.
    return Task(
        start, np.arange(9), nominal, _DEVIATION, low, high, steps, central=True
    )


def _starts(center: Float[np.ndarray, " n"]) -> Float[np.ndarray, "c n"]:
    """Gains over two decades with two delays and three cutoffs."""
    grid = []
    for gain in np.log([0.1, 0.3, 1.0, 3.0, 10.0]):
        for late in np.log([0.3, 1.0]):
            for cutoff in np.log([0.5, 1.0, 2.0]):
                shift = np.zeros(len(center))
                shift[:4] = gain, 0.5 * gain, late, cutoff
                grid.append(center + shift)
    return np.array(grid)


def _nominal(drive: JointDrive) -> Float[np.ndarray, " 9"]:
    """Parameters of the drive as simulated so far."""
    delay = max(drive.parameter("transport_delay", "delay_s", 0.01), 1e-3)
    cutoff = drive.parameter("lowpass_cutoff", "cutoff_hz", 20.0)
    speed = drive.parameter("slew_limit", "speed_rad_s", _NO_SPEED_LIMIT)
    return np.concatenate([[0.0, 0.0], np.log([delay, cutoff, speed]), np.zeros(4)])


def _rms(records: Sequence[Record], simulated: Sequence[np.ndarray]):
    """Errors of both channels over all records."""
    rest = [r.measured - y for r, y in zip(records, simulated, strict=True)]
    valid = np.concatenate([r.valid for r in records])
    all_rest = np.concatenate(rest)
    return {
        name: float(np.sqrt(np.mean(all_rest[valid[:, i], i] ** 2)))
        for i, name in enumerate(("pos", "effort"))
        if np.any(valid[:, i])
    }
