"""What a task adds to the hand: scene, start, inputs, rewards, ends and measures."""

from collections.abc import Mapping
from typing import Any, Protocol

import jax.numpy as jnp
import mujoco
from jaxtyping import Array, Bool, Float

from envs.commands import command_term
from envs.memory import Memory, PerWorldState
from envs.observations import InputTerm, Sample
from envs.physics import ModelFields, PhysicsOutput, PhysicsState
from envs.plant import Plant
from envs.randomize import RandomizeConfig
from envs.signals import Signals
from rewards import RewardTable


class HandConfig(Protocol):
    """The settings that every task has; for their meaning see `envs.tasks.crawl`."""

    @property
    def episode_s(self) -> float:
        """Episode length [s]."""
        ...

    @property
    def control_dt_s(self) -> float:
        """Control interval [s]."""
        ...

    @property
    def action_scale_rad(self) -> float:
        """α, joint-target increment at full action [rad]."""
        ...

    @property
    def action_clip(self) -> float:
        """The policy output is clipped to ± this."""
        ...

    @property
    def curriculum_scale(self) -> float:
        """Factor on the steps of the reward schedules."""
        ...

    @property
    def weights(self) -> dict[str, float]:
        """Reward weights in the place of the table's."""
        ...

    @property
    def randomize(self) -> RandomizeConfig:
        """Domain randomization."""
        ...

    @property
    def contacts_per_world(self) -> int:
        """Room for contacts on the warp backend, as a mean over the worlds."""
        ...

    @property
    def constraints_per_world(self) -> int:
        """Room for constraint rows on the warp backend, in each world."""
        ...


class HandTask(Protocol):
    """A task for `envs.env.HandEnv`, which does everything else.

    All methods are pure functions of one world. A task keeps what it carries in fields
    of `PerWorldState` and `Memory`; both have a field `task` for a pytree of its own.
    Where a method takes `carried`, these are the fields of a `Memory` by name.
    `BareTask` has the methods that a task without a scene and inputs of its own does
    not need.
    """

    @property
    def config(self) -> HandConfig:
        """Settings of the task."""
        ...

    @property
    def table(self) -> RewardTable:
        """Rows of the reward."""
        ...

    @property
    def input_terms(self) -> tuple[InputTerm, ...]:
        """The task's inputs to the policy, in their order."""
        ...

    def add_scene(self, spec: mujoco.MjSpec) -> None:
        """Adds bodies, joints and sensors of the task, but no actuators."""
        ...

    def vary_scene(
        self, plant: Plant, fields: ModelFields, world: PerWorldState
    ) -> ModelFields:
        """Model fields of a world, from those in which its hand differs."""
        ...

    def begin_world(self) -> dict[str, Any]:
        """The task's fields of `PerWorldState` in a new world."""
        ...

    def start(
        self, key: Array, plant: Plant, world: PerWorldState
    ) -> tuple[PhysicsState, Float[Array, "20"]]:
        """First physics state of an episode and the joint targets [rad] held in it."""
        ...

    def begin_episode(
        self, key: Array, world: PerWorldState, state: PhysicsState
    ) -> dict[str, Any]:
        """The task's fields of `Memory` at an episode's start in a physics state."""
        ...

    def inputs(self, carried: Mapping[str, Any], told: Sample) -> dict[str, Array]:
        """The task's inputs by name of their term.

        Args:
            carried: fields of the `Memory`.
            told: the sensors of this step, without inputs.
        """
        ...

    def scene_signals(
        self,
        plant: Plant,
        carried: Mapping[str, Any],
        signals: Signals,
        output: PhysicsOutput,
    ) -> dict[str, Array]:
        """The task's own signals by name, which become `Signals.extra`.

        Rewards bind them, terminations and measures read them, and evaluations record
        them. At an episode's start they are read too.
        """
        ...

    def privileged(
        self, carried: Mapping[str, Any], signals: Signals
    ) -> Float[Array, " n"]:
        """What the critic sees of the task besides the actor's inputs."""
        ...

    def magnitudes(
        self, memory: Memory, signals: Signals, valid: Bool[Array, ""]
    ) -> tuple[Memory, dict[str, Array]]:
        """Steps the memories of the rewards; returns what the table binds to by name.

        Where the step is not `valid`, nothing of it may enter what outlives the
        episode.
        """
        ...

    def terminated(self, signals: Signals) -> Bool[Array, ""]:
        """Whether the task ends the episode, other than by time."""
        ...

    def advance(self, memory: Memory, signals: Signals) -> Memory:
        """Prepares the task's fields for the next step, such as a new command.

        All that inputs and signals depend on changes here, and not in `magnitudes`:
        the closed loop in C MuJoCo knows no rewards.
        """
        ...

    def measures(self, signals: Signals) -> dict[str, Float[Array, ""]]:
        """Per-step scalars for the log."""
        ...

    def episode_measures(
        self, recorded: Mapping[str, Array], counts: Bool[Array, " T"]
    ) -> dict[str, Float[Array, ""]]:
        """The task's own measures of a whole episode, NaN where undefined.

        Args:
            recorded: signals over the control steps T by name, those of
                `scene_signals` and what evaluations record of every task, such as
                `joint_pos`, `palm_pos_w`, `palm_quat_w`, `failed`.
            counts: the steps that count, up to the end of the episode.
        """
        ...


class BareTask:
    """The hand alone under a command, which is all that its policy is told.

    Attributes:
        config: settings with `command`, the ranges of the commands.
    """

    config: Any

    @property
    def input_terms(self) -> tuple[InputTerm, ...]:
        """The command."""
        return (command_term(self.config.command),)

    def inputs(self, carried: Mapping[str, Any], told: Sample) -> dict[str, Array]:
        """The command: v_x, v_y [m/s] and yaw rate [rad/s]."""
        del told
        return {"command": carried["command"]}

    def add_scene(self, spec: mujoco.MjSpec) -> None:
        """Nothing but floor and hand."""

    def vary_scene(
        self, plant: Plant, fields: ModelFields, world: PerWorldState
    ) -> ModelFields:
        """Only the hand differs."""
        del plant, world
        return fields

    def scene_signals(
        self,
        plant: Plant,
        carried: Mapping[str, Any],
        signals: Signals,
        output: PhysicsOutput,
    ) -> dict[str, Array]:
        """None."""
        del plant, carried, signals, output
        return {}

    def privileged(
        self, carried: Mapping[str, Any], signals: Signals
    ) -> Float[Array, " n"]:
        """Nothing."""
        del carried, signals
        return jnp.zeros(0)

    def episode_measures(
        self, recorded: Mapping[str, Array], counts: Bool[Array, " T"]
    ) -> dict[str, Float[Array, ""]]:
        """Those of every task suffice."""
        del recorded, counts
        return {}
