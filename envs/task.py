"""What a task adds to the hand: scene, start, inputs, rewards, ends and measures."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, Self

import jax.numpy as jnp
import mujoco
from jaxtyping import Array, Bool, Float, PRNGKeyArray, Shaped

from envs.commands import command_term
from envs.config.settings.hand import UNIT as UNIT
from envs.config.settings.hand import HandSettings as HandSettings
from envs.hand.hand_file import HandFile
from envs.hand.stance import Stance
from envs.memory import Memory, PerWorldState
from envs.observations import InputTerm, Sample
from envs.physics.base import ModelFields, PhysicsOutput, PhysicsState
from envs.plant import Plant
from envs.signals import Signals
from rewards import RewardTable


class HandTask(ABC):
    """A task for `envs.env.HandEnv`, which does everything else.

    All methods are pure functions of one world. A task keeps what it carries in fields
    of `PerWorldState` and `Memory`; both have a field `task` for a pytree of its own.
    Where a method takes `carried`, these are the fields of a `Memory` by name. What is
    not abstract here is that of the hand alone under a command.

    Attributes:
        config: settings of the task; with `command`, the ranges of the commands, unless
            the task has inputs of its own.
        table: rows of the reward; they bind signals and the results of `magnitudes`.
    """

    config: Any
    table: RewardTable

    @classmethod
    def on(cls, config: Any, hand: HandFile, stance: Stance) -> Self:
        """The task for a hand that stands in its settled stance."""
        del hand, stance
        return cls(config)  # pyright: ignore[reportCallIssue]

    @property
    def input_terms(self) -> tuple[InputTerm, ...]:
        """The task's inputs to the policy, in their order: the command."""
        return (command_term(self.config.command),)

    def add_scene(self, spec: mujoco.MjSpec) -> None:
        """Adds bodies, joints and sensors of the task, but no actuators: none."""
        del spec

    def vary_scene(
        self, plant: Plant, fields: ModelFields, world: PerWorldState
    ) -> ModelFields:
        """Model fields of a world, from those in which its hand differs: these only."""
        del plant, world
        return fields

    def begin_world(self) -> dict[str, Any]:
        """The task's fields of `PerWorldState` in a new world: none."""
        return {}

    @abstractmethod
    def start(
        self, key: PRNGKeyArray, plant: Plant, world: PerWorldState
    ) -> tuple[PhysicsState, Float[Array, " joints"]]:
        """First state, x_0 = f(key), of an episode, and the joint targets held in it.

        Args:
            key: of the episode.
            plant: the hand and its settled stance.
            world: what the episodes of this world share.

        Returns:
            Positions [m, rad] and velocities [m/s, rad/s], and targets [rad].

        Source:
            Ours; each task names its own.
        """

    @abstractmethod
    def begin_episode(
        self, key: PRNGKeyArray, world: PerWorldState, state: PhysicsState
    ) -> dict[str, Any]:
        """The task's fields of `Memory` at an episode's start in a physics state."""

    def inputs(
        self, carried: Mapping[str, Any], sample: Sample
    ) -> dict[str, Float[Array, " n"]]:
        """The task's inputs, g_t = h(μ_t, o_t), by name of their term: the command.

        Args:
            carried: fields of the `Memory`.
            sample: readings of this step's sensors, still without inputs.

        Returns:
            In the units of `input_terms`; here v_x, v_y [m/s] and yaw rate [rad/s].

        Source:
            Paper, policy interfaces.
        """
        del sample
        return {"command": carried["command"]}

    def override(
        self, plant: Plant, memory: Memory, action: Float[Array, " joints"]
    ) -> tuple[Memory, Float[Array, " joints"]]:
        """What is done in the place of the policy's output a: a ← a.

        Args:
            plant: the hand.
            memory: before the step.
            action: a, not yet clipped [1].

        Returns:
            The memory before the step, and the output that takes effect [1].

        Source:
            Ours: a supervisor such as the settle ramp acts through the policy's output.
        """
        del plant
        return memory, action

    def scene_signals(
        self,
        plant: Plant,
        carried: Mapping[str, Any],
        signals: Signals,
        output: PhysicsOutput,
    ) -> dict[str, Shaped[Array, "..."]]:
        """The task's own signals s = h(x) by name, which become `Signals.extra`: none.

        Rewards bind them, terminations and measures read them, and evaluations record
        them. At an episode's start they are read too.

        Returns:
            Each in the unit that its name ends with ([m], [rad], [s]), else [1].

        Source:
            Ours.
        """
        del plant, carried, signals, output
        return {}

    def privileged(
        self, carried: Mapping[str, Any], signals: Signals
    ) -> Float[Array, " n"]:
        """What the critic sees of the task besides the actor's inputs: n = 0 numbers.

        Returns:
            Entries in SI units ([m], [m/s], [rad]), without noise and delay.

        Source:
            Pinto et al., "Asymmetric Actor Critic for Image-Based Robot Learning"
            (2018), for a critic that sees the state.
        """
        del carried, signals
        return jnp.zeros(0)

    def magnitudes(
        self, memory: Memory, signals: Signals, valid: Bool[Array, ""]
    ) -> tuple[Memory, dict[str, Float[Array, "..."]]]:
        """Steps the memories of the rewards, (μ, m) ← f(μ, s): none.

        Args:
            memory: μ, of this step.
            signals: s.
            valid: where it is not, nothing may enter what outlives the episode.

        Returns:
            The memory, and by name what the table binds besides signals, in the units
            that the kernels name ([m], [m/s], [rad]).

        Source:
            Ours; the kernels name theirs.
        """
        del signals, valid
        return memory, {}

    @abstractmethod
    def terminated(self, signals: Signals) -> Bool[Array, ""]:
        """Whether the task ends the episode, other than by time: s ∈ failures.

        Returns:
            One flag [1].

        Source:
            Ours; each task names its own.
        """

    def advance(self, memory: Memory, signals: Signals) -> Memory:
        """Prepares the task's fields for the next step, such as a new command: nothing.

        All that inputs and signals depend on changes here, and not in `magnitudes`:
        the closed loop in C MuJoCo pays no rewards.
        """
        del signals
        return memory

    @abstractmethod
    def measures(self, signals: Signals) -> dict[str, Float[Array, ""]]:
        """Per-step scalars m = h(s) for the log.

        Returns:
            Each in the unit that its name ends with ([m], [rad], [m/s]), else [1].

        Source:
            Ours; each task names its own.
        """

    def episode_measures(
        self, recorded: Mapping[str, Shaped[Array, "T ..."]], counts: Bool[Array, " T"]
    ) -> dict[str, Float[Array, ""]]:
        """The task's own measures of a whole episode, m = h(s_1 … s_T): none.

        Args:
            recorded: signals over the control steps T by name, those of
                `scene_signals` and what evaluations record of every task, such as
                `joint_pos`, `palm_pos_w`, `palm_quat_w`, `failed`.
            counts: the steps that count, up to the end of the episode.

        Returns:
            By name, with the unit at its end ([s], [rad], [m]); NaN where undefined.

        Source:
            Ours; each task names its own.
        """
        del recorded, counts
        return {}
