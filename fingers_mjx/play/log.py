"""Measured logs of a hand that walks in C MuJoCo under the deployment shim.

What a host would write of the real hand: targets, encoders, effort, IMU, and the pose
of the palm as a camera above measures it, relative to the floor.
"""

from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jaxtyping import Array, Float

from envs.physics.base import PhysicsState
from fingers_deploy.rotations import multiply
from fingers_mjx.play.player import Played, Player, Schedule
from sysid.logs.log import MeasuredLog, make_log

_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class WalkNoise:
    """White noise of what is written down, one deviation each.

    Attributes:
        joint_rad: of encoders.
        effort_nm: of efforts.
        gravity: of the parts of the gravity direction.
        gyro_rad_s: of the gyro.
        pose_m, pose_rad: of the camera, rotation about a random axis.
    """

    joint_rad: float = 3e-4
    effort_nm: float = 4e-3
    gravity: float = 2e-3
    gyro_rad_s: float = 5e-3
    pose_m: float = 3e-4
    pose_rad: float = 1.5e-3


class WalkRecorder(Player):
    """A player that also keeps what a host would log of every control step."""

    def play(self, key: Array, steps: int, schedule: Schedule | None = None) -> Played:
        """Plays one episode; `log` then returns its log."""
        self.rows: list[dict[str, np.ndarray]] = []
        return super().play(key, steps, schedule)

    def _target(self, memory: Any, state: PhysicsState) -> Float[np.ndarray, " joints"]:
        target = super()._target(memory, state)
        sensed: Any = jax.device_get(self._read(memory, state))
        reference = np.asarray(self.env.stance.joint_pos_rad)
        row = {
            "cmd": np.array(target, float),
            "pos": sensed.joint_pos + reference,
            "gravity": sensed.gravity,
            "gyro": sensed.angvel,
            "base": np.asarray(state.qpos[:7], float),
            "tau": self.rows[-1]["after"]
            if self.rows
            else np.full(target.shape, np.nan),
        }
        self.rows.append(row)
        return target

    def _advance(self, model, data, memory, target):
        drive = super()._advance(model, data, memory, target)
        self.rows[-1]["after"] = data.actuator_force.copy()
        return drive

    def log(self, rng: np.random.Generator, noise: WalkNoise | None = None):
        """Returns the log of the last episode.

        Args:
            rng: draws the noise.
            noise: its size; `WalkNoise()` if not given.
        """
        return _log(
            self.env.spec.joints, self.rows, self.env.dt, rng, noise or WalkNoise()
        )


def _log(
    names: tuple[str, ...], rows, dt: float, rng: np.random.Generator, noise: WalkNoise
) -> MeasuredLog:
    columns = {}
    gathered = {k: np.stack([row[k] for row in rows]) for k in rows[0] if k != "after"}
    size = {"pos": noise.joint_rad, "tau": noise.effort_nm, "cmd": 0.0}
    for quantity, sigma in size.items():
        values = gathered[quantity]
        values = values + rng.normal(0.0, 1.0, values.shape) * sigma
        columns |= {f"{quantity}.{n}": values[:, i] for i, n in enumerate(names)}
    for quantity, sigma in (("gravity", noise.gravity), ("gyro", noise.gyro_rad_s)):
        values = gathered[quantity] + rng.normal(0.0, sigma, (len(rows), 3))
        columns |= {f"{quantity}.{a}": values[:, i] for i, a in enumerate(_AXES)}
    base = gathered["base"]
    place = base[:, :3] + rng.normal(0.0, noise.pose_m, (len(rows), 3))
    turn = np.concatenate(
        [np.ones((len(rows), 1)), rng.normal(0.0, noise.pose_rad / 2, (len(rows), 3))],
        axis=1,
    )
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    turned = multiply(base[:, 3:].T, turn.T).T
    columns |= {f"base.{a}": place[:, i] for i, a in enumerate(_AXES)}
    columns |= {f"base.q{a}": turned[:, i] for i, a in enumerate("wxyz")}
    t_s = np.arange(len(rows)) * dt
    return make_log(names, t_s, columns, mounting="free")
