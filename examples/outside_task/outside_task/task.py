"""Crouching: the hand holds its palm at a height."""

from dataclasses import dataclass

import jax.numpy as jnp

from envs.task import HandTask
from envs.tasks.upright import near_stance
from outside_task.settings import CrouchConfig
from rewards import RewardTerm, action_rate, stance_height

TABLE = (
    RewardTerm("low", stance_height, 1.0, ("height_m", "wanted_m")),
    RewardTerm("action_rate", action_rate, -0.01, ("action", "previous_action")),
)


@dataclass(frozen=True)
class Crouch(HandTask):
    """Crouching as `envs.task.HandTask`."""

    config: CrouchConfig
    table: tuple = TABLE

    def begin_episode(self, key, world, state):
        """No command."""
        return {"command": jnp.zeros(3)}

    def start(self, key, plant, world):
        """The stance with noise."""
        return near_stance(key, plant, 0.05, 0.0), jnp.array(plant.stance.target_rad)

    def magnitudes(self, memory, signals, valid):
        """Heights of the palm: as it is and as it should be [m]."""
        wanted_m = jnp.array(self.config.height_m)
        return memory, {"height_m": signals.palm_pos_w[2], "wanted_m": wanted_m}

    def terminated(self, signals):
        """The palm touches something."""
        return signals.palm_contact > 0

    def measures(self, signals):
        """Height of the palm [m]."""
        return {"height_m": signals.palm_pos_w[2]}
