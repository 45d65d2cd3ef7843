"""Worlds that differ from others in one respect: what such an environment passes on."""

from dataclasses import dataclass

from jaxtyping import Array, Float

from envs.base import State
from envs.batch import BatchEnv


@dataclass(frozen=True)
class Wrapped:
    """Worlds of another environment; what changes them overrides `reset` or `step`.

    Attributes:
        env: the worlds.
    """

    env: BatchEnv

    @property
    def num_envs(self) -> int:
        """Number of worlds."""
        return self.env.num_envs

    @property
    def action_size(self) -> int:
        """Number of policy outputs."""
        return self.env.action_size

    @property
    def observation_size(self) -> dict[str, int]:
        """Sizes of the observations."""
        return self.env.observation_size

    @property
    def dt(self) -> float:
        """Control interval [s]."""
        return self.env.dt

    def reset(self, key: Array) -> State:
        """Starts an episode in every world."""
        return self.env.reset(key)

    def step(self, state: State, action: Float[Array, "b a"]) -> State:
        """Advances every world by one control step."""
        return self.env.step(state, action)
