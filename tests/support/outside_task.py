"""A task from outside the packages: the hand crouches at half its stance's height.

A configuration, methods of `envs.task.HandTask`, and one call of `register`.
"""

from dataclasses import dataclass, field

import jax.numpy as jnp

from envs.commands import CommandConfig
from envs.registry import Task, register
from envs.task import HandSettings, HandTask
from envs.tasks.upright import near_stance
from rewards import RewardTerm, action_rate, stance_height

CROUCH = (
    RewardTerm("low", stance_height, 1.0, ("height_m", "wanted_m")),
    RewardTerm("action_rate", action_rate, -0.01, ("action", "previous_action")),
)


@dataclass(frozen=True)
class CrouchConfig(HandSettings):
    height_m: float = field(default=0.06, metadata={"unit": "m", "low": 0.0})
    command: CommandConfig = field(default_factory=CommandConfig)


@dataclass(frozen=True)
class Crouch(HandTask):
    config: CrouchConfig
    table: tuple = CROUCH

    def begin_episode(self, key, world, state):
        return {"command": jnp.zeros(3)}

    def start(self, key, plant, world):
        return near_stance(key, plant, 0.05, 0.0), jnp.array(plant.stance.target_rad)

    def magnitudes(self, memory, signals, valid):
        wanted_m = jnp.array(self.config.height_m)
        return memory, {"height_m": signals.palm_pos_w[2], "wanted_m": wanted_m}

    def terminated(self, signals):
        return signals.palm_contact > 0

    def measures(self, signals):
        return {"height_m": signals.palm_pos_w[2]}


def register_crouch():
    register("crouch", Task(CrouchConfig, Crouch.on))
