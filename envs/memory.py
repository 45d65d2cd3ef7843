"""What an environment carries from step to step besides physics."""

from typing import Any

import flax.struct
import jax
from jaxtyping import Array, Float, Int, Key, PRNGKeyArray

from envs.hand.drive.drive import DriveState
from envs.observations import Sample
from envs.randomize import Variation
from envs.streams import stream
from rewards import Schedule


@flax.struct.dataclass
class PerWorldState:
    """What survives a reset: the world itself and how long it has trained.

    Attributes:
        key: the world's random key.
        variation: the world's draw of the domain randomization.
        weights: reward weights; replace them to sweep rewards without recompiling.
        total_steps: control steps of all episodes, which the curricula follow.
        episodes: episodes begun before this one.
        footprint: `rewards.FootprintMemory` of tasks whose table binds it, captured
            once.
        task: what else the task keeps of the world, a pytree of its own.
    """

    key: Key[Array, "*b"]
    variation: Variation
    weights: dict[str, Schedule]
    total_steps: Int[Array, "*b"]
    episodes: Int[Array, "*b"]
    footprint: Any = None
    task: Any = None

    def step_key(self, name: str) -> PRNGKeyArray:
        """Key of what is drawn under this name in the coming control step."""
        key = jax.random.fold_in(stream(self.key, name), self.total_steps)
        return jax.random.fold_in(key, self.episodes)


@flax.struct.dataclass
class Memory:
    """What an episode carries, and what survives it.

    Attributes:
        world: what survives a reset.
        steps: control steps of this episode.
        drive: state of the drive, see `envs.hand.drive`.
        target: joint targets [rad] after the last action.
        action: last clipped policy output.
        history: the last eight samples of the observation.
        command: v_x, v_y [m/s] and yaw rate [rad/s] of the coming step.
        lift: `rewards.LiftMemory` of tasks whose table binds it.
        air_time: `rewards.AirTimeMemory`, likewise.
        mean_error: `rewards.MeanErrorMemory`, likewise.
        task: what else the task carries, a pytree of its own.
    """

    world: PerWorldState
    steps: Int[Array, "*b"]
    drive: DriveState
    target: Float[Array, "*b joints"]
    action: Float[Array, "*b joints"]
    history: Sample
    command: Float[Array, "*b 3"]
    lift: Any = None
    air_time: Any = None
    mean_error: Any = None
    task: Any = None
