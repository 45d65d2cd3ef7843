"""What a task adds to the hand: start, inputs, rewards, ends and measures."""

from collections.abc import Mapping
from typing import Any, Protocol

from jaxtyping import Array, Bool, Float

from envs.memory import Memory
from envs.physics import PhysicsState
from envs.plant import Plant
from envs.randomize import RandomizeConfig
from envs.signals import Signals
from rewards import RewardTable


class HandConfig(Protocol):
    """The settings that every task has; for their meaning see `envs.crawl`."""

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
    """A task for `envs.hand_env.HandEnv`, which does everything else.

    All methods are pure functions of one world. A task keeps what it carries in fields
    of `Lasting` and `Memory`.
    """

    @property
    def config(self) -> HandConfig:
        """Settings of the task."""
        ...

    @property
    def table(self) -> RewardTable:
        """Rows of the reward."""
        ...

    def begin_world(self) -> dict[str, Any]:
        """The task's fields of `Lasting` in a new world."""
        ...

    def begin_episode(self, key: Array) -> dict[str, Any]:
        """The task's fields of `Memory` at an episode's start."""
        ...

    def start(
        self, key: Array, plant: Plant
    ) -> tuple[PhysicsState, Float[Array, "20"]]:
        """First physics state of an episode and the joint targets [rad] held in it."""
        ...

    def inputs(self, carried: Mapping[str, Any]) -> Float[Array, " inputs"]:
        """The task's inputs to the policy, from the fields of a `Memory` by name."""
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

    def advance(self, memory: Memory) -> Memory:
        """Prepares the task's fields for the next step, such as a new command."""
        ...

    def measures(self, signals: Signals) -> dict[str, Float[Array, ""]]:
        """Per-step scalars for the log."""
        ...
