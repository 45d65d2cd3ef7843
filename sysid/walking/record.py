"""A log of a walking hand as states, commands and readings on even steps.

The pose of the palm comes from a camera above (relative to the floor), its angular
velocity from the gyro; speeds are slopes of local parabolas.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.signal import savgol_filter

from envs.batch import BatchEnv
from envs.errors import InputError
from envs.hand.drive.servo import servo_drive
from envs.hand.model import PHYSICS_DT_S
from sysid.logs.log import MeasuredLog

_AXES = ("x", "y", "z")
JOINTS = 20
"""Of the hand whose effects the hypotheses name."""
_WINDOW, _ORDER = 5, 2
_LEAST_S = 10.0
_UNEVEN = 0.05


@dataclass(frozen=True, eq=False)
class WalkRecord:
    """A walking hand, row by row (n control steps).

    Attributes:
        dt: control interval [s].
        qpos: pose of the palm and joint angles.
        qvel: their velocities, angular velocity in the palm frame.
        command: targets of MuJoCo's servos in each substep of a row [rad].
        gravity: unit vector that the IMU measured, in the palm frame.
        gyro: what the gyro measured [rad/s].
        turning: angular velocity of the pose, in the palm frame [rad/s].
    """

    dt: float
    qpos: Float[np.ndarray, "n nq"]
    qvel: Float[np.ndarray, "n nv"]
    command: Float[np.ndarray, "n s joints"]
    gravity: Float[np.ndarray, "n 3"]
    gyro: Float[np.ndarray, "n 3"]
    turning: Float[np.ndarray, "n 3"]


def walk_record(log: MeasuredLog, env: BatchEnv) -> WalkRecord:
    """Prepares a log.

    Args:
        log: of a free hand, with one row in every control step.
        env: worlds of a task with the hand; its command path is used.

    Raises:
        InputError: a hand on a stand, other joints than the hand's, rows that are
            uneven or missing, columns that a walk needs, or too short a walk.
    """
    names = env.spec.joints
    if len(names) != JOINTS:
        valid = f"{JOINTS}, of the hand whose effects a walk is searched for"
        raise InputError("hand file", "description", f"{len(names)} joints", valid)
    if log.header.mounting != "free":
        valid = "free: a hand that walks"
        raise InputError(log.source, "mounting", log.header.mounting, valid)
    if log.header.joints != names:
        found = ", ".join(log.header.joints)
        raise InputError(log.source, "joints", found, ", ".join(names))
    _check_times(log, env.dt)
    joints = _columns(log, [f"pos.{n}" for n in names])
    targets = _columns(log, [f"cmd.{n}" for n in names])
    place = _columns(log, [f"base.{a}" for a in _AXES])
    quat = _columns(log, [f"base.q{a}" for a in "wxyz"])
    quat = quat / np.linalg.norm(quat, axis=1, keepdims=True)
    quat = quat * np.where(np.cumsum(_flips(quat)) % 2, -1.0, 1.0)[:, None]
    smooth = np.asarray(savgol_filter(quat, _WINDOW, _ORDER, axis=0))
    smooth = smooth / np.linalg.norm(smooth, axis=1, keepdims=True)
    turning = 2.0 * _turned_back(smooth, _slope(quat, env.dt))
    gyro = _columns(log, [f"gyro.{a}" for a in _AXES])
    slopes = [_slope(place, env.dt), turning, _slope(joints, env.dt)]
    pose = [savgol_filter(place, _WINDOW, _ORDER, axis=0), smooth, joints]
    return WalkRecord(
        dt=env.dt,
        qpos=np.concatenate(pose, 1),
        qvel=np.concatenate(slopes, 1),
        command=_commands(env, targets),
        gravity=_columns(log, [f"gravity.{a}" for a in _AXES]),
        gyro=gyro,
        turning=turning,
    )


def _check_times(log: MeasuredLog, dt: float) -> None:
    """Refuses rows that are not one control step apart, and too few of them."""
    steps = np.diff(log.t_s)
    if steps.size * dt < _LEAST_S:
        found = f"{steps.size * dt:.3g} s"
        raise InputError(log.source, "t", found, f"at least {_LEAST_S:g} s")
    worst = float(np.max(np.abs(steps - dt)))
    if worst > _UNEVEN * dt:
        found, valid = f"steps off by {worst:.3g} s", f"a row every {dt:g} s"
        raise InputError(log.source, "t", found, valid)


def _columns(log: MeasuredLog, names: list[str]) -> np.ndarray:
    """Columns side by side, all readings there."""
    for name in names:
        if name not in log.columns:
            raise InputError(log.source, "columns", f"no {name}", "a log of a walk")
        if np.any(np.isnan(log.columns[name])):
            valid = "readings in all rows"
            raise InputError(log.source, name, "missing readings", valid)
    return np.stack([log.column(name) for name in names], 1)


def _flips(quat: np.ndarray) -> np.ndarray:
    """Rows at which a quaternion changes to its negative, the same rotation."""
    return np.append(False, np.sum(quat[1:] * quat[:-1], 1) < 0.0)


def _slope(values: np.ndarray, dt: float) -> np.ndarray:
    slope = savgol_filter(values, _WINDOW, _ORDER, deriv=1, delta=dt, axis=0)
    return np.asarray(slope)


def _turned_back(q: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Vector part of q* q̇, half the angular velocity in the turned frame."""
    w, u, dw, du = q[:, :1], q[:, 1:], rate[:, :1], rate[:, 1:]
    return w * du - dw * u - np.cross(u, du)


def _commands(env: BatchEnv, targets: np.ndarray) -> Float[np.ndarray, "n s joints"]:
    """What the command path makes of the targets; before the log it had rested."""
    drive = servo_drive(env.hand, env.plant.n_substeps, PHYSICS_DT_S)
    begin = drive.begin(jnp.asarray(targets[0], jnp.float32))
    found = jax.lax.scan(drive.commands, begin, jnp.asarray(targets, jnp.float32))[1]
    return np.asarray(found, float)
