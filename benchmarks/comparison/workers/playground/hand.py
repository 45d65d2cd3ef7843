"""The standing hand as an environment of MuJoCo Playground, as its joystick tasks are.

Actions move targets around the stance; the reward asks for a level palm at its height.
Neither delay, command filter, history nor randomized models: the peer has no part for
them that all its tasks share.
"""

# pyright: reportMissingImports=false, reportAttributeAccessIssue=false
from pathlib import Path

import jax
import jax.numpy as jnp
import mujoco
from ml_collections import config_dict
from mujoco import mjx
from mujoco.mjx._src.math import quat_inv, rotate
from mujoco_playground import MjxEnv, State, step
from mujoco_playground._src.mjx_env import make_data

from benchmarks.comparison.workers.walking import (
    ACTION_RATE,
    ALIVE,
    COMMAND_MPS,
    LOWEST_M,
    START_RAD,
    TRACKING,
    WIDTH_MPS,
)

ACTION_SCALE = 0.3
Judged = tuple[jax.Array, jax.Array, dict[str, jax.Array]]
ROOM = {"naconmax": 48, "njmax": 128}
"""Contacts and constraints per world that Warp gets space for, as ours."""


class HandStand(MjxEnv):
    """A hand that shall stand.

    Args:
        mjcf: the standing hand with its key frame.
        impl: `jax` or `warp`.
        worlds: how many there will be, for Warp's buffers.
    """

    def __init__(self, mjcf: Path, impl: str, worlds: int):
        config = config_dict.create(
            ctrl_dt=0.02, sim_dt=0.005, episode_length=1000, action_repeat=1, impl=impl
        )
        super().__init__(config)
        self._path = str(mjcf)
        self._mj_model = mujoco.MjModel.from_xml_path(self._path)
        self._mjx_model = mjx.put_model(self._mj_model, impl=impl)
        key = self._mj_model.keyframe("stance")
        self._stance, self._held = jnp.array(key.qpos), jnp.array(key.ctrl)
        room = ROOM | {"naconmax": ROOM["naconmax"] * worlds}
        self._room = room if impl == "warp" else {}

    def reset(self, rng: jax.Array) -> State:
        """Starts near the stance."""
        data = make_data(
            self._mj_model,
            qpos=self._stance.at[7:].add(self._offset_rad(rng)),
            qvel=jnp.zeros(self._mj_model.nv),
            ctrl=self._held,
            impl=self._config.impl,
            **self._room,
        )
        data = mjx.forward(self._mjx_model, data)
        zero, last = jnp.zeros(()), jnp.zeros(self.action_size)
        obs = self._seen(data, last)
        metrics = jax.tree.map(jnp.zeros_like, self._judged(data, last, last)[2])
        return State(data, obs, zero, zero, metrics, {"last": last})

    def step(self, state: State, action: jax.Array) -> State:
        """Moves the targets and does four physics steps."""
        targets = self._held + ACTION_SCALE * action
        data = step(self._mjx_model, state.data, targets, self.n_substeps)
        reward, fallen, metrics = self._judged(data, action, state.info["last"])
        return state.replace(
            data=data,
            obs=self._seen(data, action),
            reward=reward,
            done=fallen.astype(jnp.float32),
            metrics=metrics,
            info=state.info | {"last": action},
        )

    def _offset_rad(self, rng: jax.Array) -> jax.Array:
        """Returns what the joints are off the stance at the start."""
        return START_RAD * jax.random.normal(rng, (self.action_size,))

    def _judged(self, data, action: jax.Array, last: jax.Array) -> Judged:
        """Returns the reward, whether the hand fell, and what is logged of a step."""
        height = jnp.abs(data.qpos[2] - self._stance[2])
        turned = 1.0 - jnp.abs(data.qpos[3:7] @ self._stance[3:7])
        upright = jnp.exp(-(height / 0.02) - turned / 0.02)
        fallen = (height > 0.06) | jnp.isnan(data.qpos).any()
        return upright, fallen, {"upright": upright}

    def _seen(self, data, last: jax.Array) -> jax.Array:
        return jnp.concatenate([data.qpos[2:], data.qvel, last])

    @property
    def xml_path(self) -> str:
        """Path of the model."""
        return self._path

    @property
    def action_size(self) -> int:
        """Joints."""
        return self._mj_model.nu

    @property
    def mj_model(self) -> mujoco.MjModel:
        """Model."""
        return self._mj_model

    @property
    def mjx_model(self) -> mjx.Model:
        """Model on the device."""
        return self._mjx_model


class HandWalk(HandStand):
    """A hand that shall walk straight forward, by the terms that mjlab's is given.

    Its heading is that of its palm. Rewards are times the control interval, as those
    of Playground's joystick tasks and of mjlab are.
    """

    def _offset_rad(self, rng: jax.Array) -> jax.Array:
        drawn = jax.random.uniform(rng, (self.action_size,), minval=-1.0)
        return START_RAD * drawn

    def _judged(self, data, action: jax.Array, last: jax.Array) -> Judged:
        broken = jnp.isnan(data.qpos).any() | jnp.isnan(data.qvel).any()
        fallen = (data.qpos[2] < LOWEST_M) | broken
        forward_w = jnp.array([1.0, 0.0, 0.0])
        ahead = rotate(rotate(forward_w, quat_inv(self._stance[3:7])), data.qpos[3:7])
        ahead = ahead[:2] / jnp.maximum(jnp.linalg.norm(ahead[:2]), 1e-6)
        along = data.qvel[:2] @ ahead
        across = data.qvel[1] * ahead[0] - data.qvel[0] * ahead[1]
        apart = (along - COMMAND_MPS) ** 2 + across**2
        tracking = jnp.nan_to_num(jnp.exp(-apart / WIDTH_MPS**2))
        paid = ALIVE * (1.0 - fallen) + TRACKING * tracking
        paid += ACTION_RATE * jnp.sum((action - last) ** 2)
        return paid * self.dt, fallen, {"speed_mps": jnp.nan_to_num(along)}

    def _seen(self, data, last: jax.Array) -> jax.Array:
        to_palm = quat_inv(data.qpos[3:7])
        gravity = rotate(jnp.array([0.0, 0.0, -1.0]), to_palm)
        velocity = (rotate(data.qvel[:3], to_palm), data.qvel[3:])
        joints = data.qpos[7:] - self._stance[7:]
        return jnp.concatenate([joints, gravity, *velocity, last])
