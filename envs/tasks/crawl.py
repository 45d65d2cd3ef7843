"""The crawl task: follow planar velocity and yaw-rate commands on five fingertips."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray, Shaped

from envs.commands import sample_command
from envs.config.settings.crawl import CrawlConfig as CrawlConfig
from envs.config.settings.rows import table_of
from envs.hand.hand_file import HandFile
from envs.hand.stance import Stance
from envs.memory import Memory, PerWorldState
from envs.physics.base import PhysicsOutput, PhysicsState
from envs.plant import Plant
from envs.rotations import unrotate
from envs.signals import Signals
from envs.streams import stream
from envs.tasks.gait import Walking
from envs.tasks.upright import near_stance
from rewards import RewardTable, safe_norm


@dataclass(frozen=True)
class Crawl(Walking):
    """The crawl task as `envs.task.HandTask`.

    Attributes:
        config: settings of the task.
        tips: fingertips of the hand.
        table: rows of the reward that the settings name; they may bind every signal,
            those of `scene_signals` and the magnitudes of `magnitudes`.
    """

    config: CrawlConfig
    tips: int = field(default=5, kw_only=True)
    table: RewardTable = field(init=False)

    @classmethod
    def on(cls, config: CrawlConfig, hand: HandFile, stance: Stance) -> Self:
        """The task for a hand with as many fingertips as its stance."""
        del hand
        return cls(config, tips=len(stance.footprint_v))

    def __post_init__(self) -> None:
        object.__setattr__(self, "table", table_of("crawl", self.config.rewards))

    def begin_episode(
        self, key: PRNGKeyArray, world: PerWorldState, state: PhysicsState
    ) -> dict[str, Any]:
        """A first command and fresh memories of the gait."""
        del world, state
        command = sample_command(key, self.config.command)
        return {"command": command} | self.begin_gait()

    def start(
        self, key: PRNGKeyArray, plant: Plant, world: PerWorldState
    ) -> tuple[PhysicsState, Float[Array, " joints"]]:
        """The stance with noise, q = q* + u, at a random heading, under its targets.

        Returns:
            The state, and the joint targets of the stance [rad].

        Source:
            Ours.
        """
        del world
        joint_rad, speed_mps = self.config.reset_joint_rad, self.config.reset_speed_mps
        state = near_stance(key, plant, joint_rad, speed_mps)
        return state, jnp.array(plant.stance.target_rad)

    def advance(self, memory: Memory, signals: Signals) -> Memory:
        """Draws the next command when its time has come, and what follows it anew."""
        del signals
        config = self.config
        period = round(config.command.resample_s / config.control_dt_s)
        due = memory.steps % period == 0
        world = memory.world
        key = jax.random.fold_in(stream(world.key, "resample"), world.total_steps)
        fresh = {
            "command": sample_command(key, config.command)
        } | self.begin_with_command()
        old = {name: getattr(memory, name) for name in fresh}
        kept = jax.tree.map(lambda new, old: jnp.where(due, new, old), fresh, old)
        return memory.replace(**kept)

    def scene_signals(
        self,
        plant: Plant,
        carried: Mapping[str, Any],
        signals: Signals,
        output: PhysicsOutput,
    ) -> dict[str, Shaped[Array, "..."]]:
        """Gravity in V, g_V = q_off* ⊗ g_b ⊗ q_off, where the table binds it.

        Returns:
            `gravity_v` [1], or nothing.

        Source:
            Paper, design of the ablation.
        """
        del carried, output
        if not self.binds("gravity_v"):
            return {}
        return {"gravity_v": unrotate(jnp.array(plant.stance.q_off), signals.gravity_b)}

    def measures(self, signals: Signals) -> dict[str, Float[Array, ""]]:
        """Speed of the palm along the commanded direction, v_xy · v_cmd/‖v_cmd‖.

        Returns:
            `task_speed_mps` [m/s]; 0 where no planar motion is commanded.

        Source:
            Paper, task-direction speed.
        """
        planar = signals.command[:2]
        along = jnp.sum(signals.vel_v[:2] * planar)
        return {"task_speed_mps": along / jnp.maximum(safe_norm(planar), 1e-6)}
