"""Playing a plan of targets in the place of a policy, for identification.

The plan passes through the same supervisor, with the same limits, as a policy would.
"""

import csv
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fingers_deploy.errors import InputError
from fingers_deploy.files import read_regular
from fingers_deploy.manifest import Interface
from fingers_robot.behaviour.exchange import Answer, Query, padded, propose
from fingers_robot.reading import JOINT_COUNT, Array
from fingers_robot.safety.motion import toward

_MAX_BYTES = 64 * 2**20
_MAX_CELLS = 2_000_000  # half an hour of 20 joints at 50 Hz
_NO_COMMAND = padded(np.zeros(0, np.float32))


@dataclass(frozen=True)
class Targets:
    """A plan: times since its start [n] and joint targets [n, 20], linear between."""

    t_s: Array
    target_rad: Array


def read_plan(path: str | Path, interface: Interface) -> Targets:
    """Reads a CSV with the columns `t` [s] and `cmd.<joint>` [rad].

    Joints without a column stay at their initial target.

    Raises:
        InputError: another form, times that do not increase, targets outside the
            limits or faster than the policy may move them.
    """
    path = Path(path)
    names, rows = _read(path)
    joints = [name.removeprefix("cmd.") for name in names[1:]]
    unknown = [j for j in joints if j not in interface.joint_names]
    if names[:1] != ["t"] or unknown:
        found = ", ".join(unknown or names[:1])
        raise InputError(path, "header", found, "t, cmd.<joint>, … of this hand")
    t_s = rows[:, 0]
    if not (np.diff(t_s) > 0).all():
        raise InputError(path, "t", "a time that does not increase", "growing times")
    target = np.tile(
        np.asarray(interface.initial_target_rad, np.float64), (len(t_s), 1)
    )
    for column, joint in enumerate(joints, start=1):
        target[:, interface.joint_names.index(joint)] = rows[:, column]
    plan = Targets(t_s - t_s[0], target)
    _check(plan, interface, path)
    return plan


class Plan:
    """Answers queries from a plan, as `Policies` does from policies.

    Args:
        targets: the plan.
        interface: of the hand.
    """

    def __init__(self, targets: Targets, interface: Interface):
        self._plan = targets
        self._step_rad = interface.action.scale_rad
        self._start_s: float | None = None

    def finish(self) -> tuple[str, ...]:
        """Has nothing to report."""
        return ()

    def answer(self, query: Query) -> Answer:
        """Answers a query; the plan begins when the policy may run."""
        target = np.asarray(query.target_rad, np.float64)
        if not query.runs:
            self._start_s = None
        else:
            self._start_s = query.t_s if self._start_s is None else self._start_s
            wanted = self._at(query.t_s - self._start_s)
            target = toward(target, wanted, self._step_rad)
        return Answer(propose(query, target), _NO_COMMAND, 0)

    def _at(self, elapsed_s: float) -> Array:
        plan = self._plan
        return np.array(
            [np.interp(elapsed_s, plan.t_s, joint) for joint in plan.target_rad.T]
        )


def _read(path: Path) -> tuple[list[str], Array]:
    data = read_regular(path, _MAX_BYTES)
    columns = data[: data.find(b"\n") + 1].count(b",") + 1
    if columns > JOINT_COUNT + 1:
        raise InputError(path, "header", f"{columns} columns", f"t and {JOINT_COUNT}")
    if data.count(b",") > _MAX_CELLS:
        raise InputError(path, "", "more cells", f"at most {_MAX_CELLS}")
    try:
        text = io.StringIO(data.decode("utf-8"), newline="")
        lines = list(csv.reader(text))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(path, "", error, "a readable CSV file") from error
    if len(lines) < 3:
        raise InputError(path, "", f"{len(lines)} lines", "a header and two rows")
    for number, line in enumerate(lines[1:], start=2):
        if len(line) != len(lines[0]):
            found, valid = f"{len(line)} cells", f"{len(lines[0])}, as in the header"
            raise InputError(path, f"line {number}", found, valid)
    try:
        rows = np.array(lines[1:], np.float64)
    except ValueError as error:
        raise InputError(path, "", error, "numbers") from error
    if not np.isfinite(rows).all():
        raise InputError(path, "", "NaN or infinity", "finite numbers")
    return lines[0], rows


def _check(plan: Targets, interface: Interface, path: Path) -> None:
    limits = np.asarray(interface.joint_limits_rad)
    outside = (plan.target_rad < limits[:, 0]) | (plan.target_rad > limits[:, 1])
    fastest = interface.action.scale_rad * interface.control_rate_hz
    speed = np.abs(np.diff(plan.target_rad, axis=0)) / np.diff(plan.t_s)[:, None]
    for i, name in enumerate(interface.joint_names):
        if outside[:, i].any():
            found, valid = "a target outside its limits", f"{limits[i].tolist()}"
            raise InputError(path, f"cmd.{name}", found, valid)
        if speed[:, i].max() > fastest:
            found, valid = (
                f"{speed[:, i].max():.2f} rad/s",
                f"up to {fastest:.2f} rad/s",
            )
            raise InputError(path, f"cmd.{name}", found, valid)
