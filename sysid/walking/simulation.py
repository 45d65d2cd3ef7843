"""Short walks of candidate hands from measured states, side by side in C MuJoCo.

A walk is chaotic over seconds and predictable over tenths of one. So it is cut into
pieces; each begins in the measured state and follows the recorded targets, and what it
misses at its end is the residual.
"""

import copy
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import jax
import numpy as np
from jaxtyping import Float
from mujoco import rollout

from envs.batch import BatchEnv
from envs.physics.base import nominal_field
from envs.physics.quiet_mujoco import mujoco
from sysid.walking.record import WalkRecord

PIECE_STEPS, LOOKS = 10, (5, 10)
"""Control steps of a piece, and after how many of them it is compared."""

CHANNELS = 6 + 20
"""Forward, left, up [m]; roll, pitch, yaw [rad]; joints [rad]."""

Candidate = Mapping[str, Mapping[str, Any]]
"""Parameters by effect."""


class Pieces:
    """All pieces of a walk.

    Args:
        env: worlds of a task with the hand that has all candidates' effects.
        record: the walk.
    """

    def __init__(self, env: BatchEnv, record: WalkRecord):
        self.env, self.record = env, record
        self.starts = np.arange(0, len(record.qpos) - PIECE_STEPS - 1, PIECE_STEPS)
        model = env.mj_model
        spec = mujoco.mjtState.mjSTATE_FULLPHYSICS
        self._fields = jax.jit(
            lambda params: replace(env.plant.effects, params=params).change({})
        )
        self._data = mujoco.MjData(model)
        self._states = np.zeros((len(self.starts), mujoco.mj_stateSize(model, spec)))
        for row, start in zip(self._states, self.starts, strict=True):
            self._data.qpos[:] = record.qpos[start]
            self._data.qvel[:] = record.qvel[start]
            mujoco.mj_getState(model, self._data, row, spec)
        index = self.starts[:, None] + np.arange(PIECE_STEPS)
        self._control = record.command[index].reshape(len(self.starts), -1, 20)

    def misses(self, candidate: Candidate) -> Float[np.ndarray, "p k c"]:
        """y(t_0 + k Δt) − ŷ(t_0 + k Δt; θ) of every piece, k ∈ {5, 10} steps after t_0.

        Args:
            candidate: parameters θ by effect and name.

        Returns:
            By piece and k: forward, left, up [m], roll, pitch, yaw [rad], in the
            heading at t_0, and 20 joints [rad].

        Source:
            Ours; multiple shooting of a chaotic system from measured states.
        """
        model = self._model(candidate)
        states, _ = rollout.rollout(model, self._data, self._states, self._control)
        substeps = self.record.command.shape[1]
        found = []
        for steps in LOOKS:
            simulated = states[:, steps * substeps - 1, 1:28]
            found.append(self._missed(simulated, self.starts + steps))
        return np.stack(found, 1)

    def _model(self, candidate: Candidate):
        """The nominal model with the candidate's effects in it."""
        fields = self._fields(candidate)
        model = copy.copy(self.env.mj_model)
        model.body_sameframe[:] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
        for name, value in fields.items():
            nominal_field(model, name)[:] = np.asarray(value)
        return model

    def _missed(self, simulated: np.ndarray, rows: np.ndarray) -> np.ndarray:
        measured = self.record.qpos[rows]
        heading = _yaw_of(self.record.qpos[self.starts, 3:7])
        moved = measured[:, :3] - simulated[:, :3]
        ahead = np.cos(heading) * moved[:, 0] + np.sin(heading) * moved[:, 1]
        left = np.cos(heading) * moved[:, 1] - np.sin(heading) * moved[:, 0]
        turned = _rotation(measured[:, 3:7], simulated[:, 3:7])
        c, s = np.cos(heading), np.sin(heading)
        roll = c * turned[:, 0] + s * turned[:, 1]
        pitch = c * turned[:, 1] - s * turned[:, 0]
        parts = [ahead, left, moved[:, 2], roll, pitch, turned[:, 2]]
        joints = measured[:, 7:] - simulated[:, 7:]
        return np.concatenate([np.stack(parts, 1), joints], 1)


def _yaw_of(quat: Float[np.ndarray, "n 4"]) -> Float[np.ndarray, " n"]:
    """Heading of poses [rad]."""
    w, x, y, z = quat.T
    return np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _rotation(a: np.ndarray, b: np.ndarray) -> Float[np.ndarray, "n 3"]:
    """Rotation vector in the world that turns b into a, for small angles."""
    w, u, x, v = a[:, :1], a[:, 1:], b[:, :1], -b[:, 1:]
    scalar = w * x - np.sum(u * v, 1, keepdims=True)
    vector = w * v + x * u + np.cross(u, v)
    return 2.0 * vector * np.where(scalar < 0.0, -1.0, 1.0)
