"""The environment contract: what `reset` and `step` return."""

from collections.abc import Mapping
from typing import Any, Protocol

import flax.struct
from jaxtyping import Array, Float, Key, PRNGKeyArray


@flax.struct.dataclass
class State:
    """One world between two control steps, in the Brax/Playground layout.

    Attributes:
        data: physics state (`envs.physics.PhysicsState`).
        obs: "state" for the actor and "privileged_state" for the critic.
        reward: sum of the weighted reward terms of this step, times the interval.
        done: 1 if the episode ended in this step, for whichever reason.
        metrics: per-step scalars with fixed keys; "reward/<term>" add up to `reward`.
        info: "truncation" (ended by the time limit), "invalid" (non-finite state),
            "episode_return" and "episode_length" of the running episode.
        signals: what rewards, terminations and measures read (`envs.signals.Signals`).
        memory: everything carried from step to step that is not physics.
    """

    data: Any
    obs: dict[str, Float[Array, "..."]]
    reward: Float[Array, "..."]
    done: Float[Array, "..."]
    metrics: dict[str, Float[Array, "..."]]
    info: dict[str, Float[Array, "..."]]
    signals: Any
    memory: Any


class VectorEnv(Protocol):
    """Worlds in step, each reset by itself: what learning and evaluation need."""

    @property
    def num_envs(self) -> int:
        """Number of worlds."""
        ...

    @property
    def action_size(self) -> int:
        """Number of policy outputs."""
        ...

    @property
    def observation_size(self) -> Mapping[str, int]:
        """Sizes of "state" and "privileged_state"."""
        ...

    @property
    def dt(self) -> float:
        """Control interval [s]."""
        ...

    def reset(self, key: PRNGKeyArray | Key[Array, " members"]) -> State:
        """Starts an episode in every world."""
        ...

    def step(self, state: State, action: Float[Array, "b a"]) -> State:
        """Advances every world by one control step, x ← f(x, a).

        Args:
            state: of all worlds.
            action: policy outputs [1].

        Source:
            Ours; the layout of the state is that of Brax and MuJoCo Playground.
        """
        ...
