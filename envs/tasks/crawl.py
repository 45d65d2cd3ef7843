"""The crawl task: follow planar velocity and yaw-rate commands on five fingertips."""

from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from envs.commands import CommandConfig, sample_command
from envs.env import HandEnv
from envs.errors import InputError
from envs.hand.hand_file import HandFile
from envs.hand.stance import Stance
from envs.memory import Memory, PerWorldState
from envs.physics import PhysicsState
from envs.plant import Plant, check_interval
from envs.randomize import RandomizeConfig
from envs.scoring import check_weights
from envs.signals import Signals
from envs.streams import stream
from envs.task import BareTask
from envs.tasks.gait import fallen, step_gait
from envs.tasks.start import near_stance
from rewards import (
    CRAWL,
    RewardTable,
    init_footprint_memory,
    init_lift_memory,
    safe_norm,
)


@dataclass(frozen=True)
class CrawlConfig:
    """Settings of the crawl task.

    Attributes:
        episode_s: episode length (paper).
        control_dt_s: control interval (paper: 50 Hz).
        action_scale_rad: α, joint-target increment at full action (paper).
        action_clip: the policy output is clipped to ± this (ours; the paper clips
            without giving the bound).
        max_roll_deg, max_pitch_deg: tilt of V that ends the episode (paper).
        reset_joint_rad: largest joint offset at reset (ours).
        reset_speed_mps: largest base speed at reset, each axis (ours).
        curriculum_scale: factor on the steps of the reward schedules; 1 is the
            paper's, which is made for 8,000 iterations of 24 steps.
        weights: reward weights that replace the start value of the table's.
        command: ranges of the commands.
        randomize: domain randomization.
        contacts_per_world, constraints_per_world: room for contacts and constraint
            rows on the warp backend, see `make_physics`; what does not fit
            is dropped, and told (`envs.physics.room`).
    """

    episode_s: float = field(
        default=20.0, metadata={"unit": "s", "low": 0.1, "high": 1e6}
    )
    control_dt_s: float = field(default=0.02, metadata={"unit": "s", "low": 0.005})
    action_scale_rad: float = field(default=0.060, metadata={"unit": "rad", "low": 0.0})
    action_clip: float = field(default=1.5, metadata={"unit": "1", "low": 0.1})
    max_roll_deg: float = field(default=35.0, metadata={"unit": "deg", "low": 1.0})
    max_pitch_deg: float = field(default=30.0, metadata={"unit": "deg", "low": 1.0})
    reset_joint_rad: float = field(default=0.05, metadata={"unit": "rad", "low": 0.0})
    reset_speed_mps: float = field(default=0.05, metadata={"unit": "m/s", "low": 0.0})
    curriculum_scale: float = field(default=1.0, metadata={"unit": "1", "low": 1e-3})
    weights: dict[str, float] = field(default_factory=dict)
    command: CommandConfig = field(default_factory=CommandConfig)
    randomize: RandomizeConfig = field(default_factory=RandomizeConfig)
    contacts_per_world: int = field(default=48, metadata={"low": 1, "free": True})
    constraints_per_world: int = field(default=128, metadata={"low": 1, "free": True})

    def __post_init__(self) -> None:
        check_interval(self.control_dt_s)
        check_weights(CRAWL, self.weights)
        if self.command.resample_s < self.control_dt_s:
            found, valid = self.command.resample_s, f">= {self.control_dt_s:g} s"
            raise InputError("configuration", "command.resample_s", found, valid)


@dataclass(frozen=True)
class Crawl(BareTask):
    """The crawl task as `envs.task.HandTask`.

    Attributes:
        config: settings of the task.
        table: rows of the reward; they may bind every signal and the magnitudes of
            `magnitudes`.
    """

    config: CrawlConfig
    table: RewardTable = CRAWL

    def begin_world(self) -> dict[str, Any]:
        """No footprint yet: it is captured in the first step and then kept (paper)."""
        return {"footprint": init_footprint_memory()}

    def begin_episode(
        self, key: Array, world: PerWorldState, state: PhysicsState
    ) -> dict[str, Any]:
        """A first command and a fresh lift memory."""
        del world, state
        command = sample_command(key, self.config.command)
        return {"command": command, "lift": init_lift_memory()}

    def start(
        self, key: Array, plant: Plant, world: PerWorldState
    ) -> tuple[PhysicsState, Float[Array, "20"]]:
        """The stance with noise, at a random heading (ours), under its targets."""
        del world
        joint_rad, speed_mps = self.config.reset_joint_rad, self.config.reset_speed_mps
        state = near_stance(key, plant, joint_rad, speed_mps)
        return state, jnp.array(plant.stance.target_rad)

    def magnitudes(
        self, memory: Memory, signals: Signals, valid: Bool[Array, ""]
    ) -> tuple[Memory, dict[str, Array]]:
        """Steps the footprint and lift memories."""
        return step_gait(memory, signals, valid, self.config.control_dt_s)

    def terminated(self, signals: Signals) -> Bool[Array, ""]:
        """Palm contact, or V tilted beyond the limits (paper)."""
        return fallen(signals, self.config)

    def advance(self, memory: Memory, signals: Signals) -> Memory:
        """Draws the next command when its time has come, and resets the lift memory."""
        del signals
        config = self.config
        period = round(config.command.resample_s / config.control_dt_s)
        due = memory.steps % period == 0
        world = memory.world
        key = jax.random.fold_in(stream(world.key, "resample"), world.total_steps)
        fresh = (sample_command(key, config.command), init_lift_memory())
        command, lift = jax.tree.map(
            lambda new, old: jnp.where(due, new, old),
            fresh,
            (memory.command, memory.lift),
        )
        return memory.replace(command=command, lift=lift)

    def measures(self, signals: Signals) -> dict[str, Float[Array, ""]]:
        """Speed of the palm along the commanded direction."""
        planar = signals.command[:2]
        along = jnp.sum(signals.vel_v[:2] * planar)
        return {"task_speed_mps": along / jnp.maximum(safe_norm(planar), 1e-6)}


class CrawlEnv(HandEnv):
    """One world of the crawl task; the caller vmaps it.

    Args:
        config: settings of the task.
        backend, num_worlds, hand, stance: see `envs.env.HandEnv`.
    """

    def __init__(
        self,
        config: CrawlConfig | None = None,
        backend: str = "cpu",
        num_worlds: int = 1,
        hand: HandFile | None = None,
        stance: Stance | None = None,
    ):
        super().__init__(
            Crawl(config or CrawlConfig()), backend, num_worlds, hand, stance
        )
