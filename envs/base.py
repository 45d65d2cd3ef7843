"""The environment contract: what `reset` and `step` return."""

from typing import Any

import flax.struct
from jaxtyping import Array, Float


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
