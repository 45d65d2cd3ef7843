"""A measured log as a second hand beside the simulated one."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from envs.errors import InputError
from envs.hand.spec import hand_spec
from fingers_deploy.rotations import multiply
from fingers_mjx.play.viewer.view import Poses, body_poses
from sysid.logs.log import MeasuredLog

BASE = ("base.x", "base.y", "base.z", "base.qw", "base.qx", "base.qy", "base.qz")


@dataclass(frozen=True)
class Motion:
    """What a log says of the pose of a hand.

    Attributes:
        t_s: times from the beginning [s].
        joint_pos: joint angles [rad], NaN where the log has no reading.
        base: pose of the palm on the floor (position [m], quaternion w x y z); None
            where the log does not have it.
    """

    t_s: Float[np.ndarray, " n"]
    joint_pos: Float[np.ndarray, "n joints"]
    base: Float[np.ndarray, "n 7"] | None

    @property
    def length_s(self) -> float:
        """From the first row to the last [s]."""
        return float(self.t_s[-1])


def motion_of(log: MeasuredLog, names: tuple[str, ...]) -> Motion:
    """Returns the motion of a whole hand.

    Args:
        log: of the hand.
        names: of its joints, in order.

    Raises:
        InputError: a joint of the hand is missing, or time runs backward.
    """
    joint_pos = np.stack([log.column(f"pos.{name}") for name in names], axis=1)
    if np.any(np.diff(log.t_s) <= 0.0):
        valid = "times that rise from row to row"
        raise InputError(log.source, "t_s", "times that run backward", valid)
    known = all(name in log.columns for name in BASE)
    base = np.stack([log.column(name) for name in BASE], axis=1) if known else None
    return Motion(log.t_s - log.t_s[0], joint_pos, base)


class Ghost:
    """The measured hand in the scene of the simulated one; it begins anew at its end.

    Args:
        model: the scene, whose hand it takes.
        motion: what it does.
    """

    def __init__(self, model: mujoco.MjModel, motion: Motion):
        self._model, self._data = model, mujoco.MjData(model)
        self._hand = hand_spec(model)
        self.motion = motion

    def at(
        self, t_s: float, start: Float[np.ndarray, "7"], now: Float[np.ndarray, "7"]
    ) -> Poses | None:
        """Returns the poses of all bodies; None where a reading is missing.

        The path of a log that has one begins where the simulated hand began, in its
        heading; a log without goes along with the simulated palm, so that joints are
        compared.

        Args:
            t_s: time since the episode began [s].
            start: pose of the simulated palm at that time.
            now: its pose now.
        """
        row = self.row(t_s)
        joint_pos = self.motion.joint_pos[row]
        base = now if self.motion.base is None else self._base(row, start)
        if not (np.isfinite(joint_pos).all() and np.isfinite(base).all()):
            return None
        self._data.qpos[:7], self._data.qpos[self._hand.joint_qpos] = base, joint_pos
        self._data.qpos[self._hand.nq :] = self._model.qpos0[self._hand.nq :]
        mujoco.mj_kinematics(self._model, self._data)
        return body_poses(self._data)

    def row(self, t_s: float) -> int:
        """Returns the row that was the latest at a time; nothing is made up between."""
        length_s = self.motion.length_s
        since = t_s % length_s if length_s > 0.0 else 0.0
        return int(np.searchsorted(self.motion.t_s, since, side="right")) - 1

    def _base(self, row: int, start: Float[np.ndarray, "7"]) -> np.ndarray:
        base = self.motion.base
        assert base is not None
        turn = heading(start[3:]) - heading(base[0, 3:])
        cos, sin = np.cos(turn), np.sin(turn)
        x, y = base[row, :2] - base[0, :2]
        moved = [cos * x - sin * y, sin * x + cos * y]
        half = np.array([np.cos(turn / 2), 0.0, 0.0, np.sin(turn / 2)])
        place = [*(start[:2] + moved), base[row, 2]]
        return np.concatenate([place, multiply(half, base[row, 3:])])


def heading(quat_w: Float[np.ndarray, "4"]) -> float:
    """Returns where the fingers point on the floor, the palm's z axis [rad]."""
    w, x, y, z = quat_w
    return float(np.arctan2(2 * (y * z - w * x), 2 * (x * z + w * y)))
