"""The actor's observation: five terms, eight samples each, oldest to newest."""

import flax.struct
import jax.numpy as jnp
from jaxtyping import Array, Float

HISTORY = 8
TERMS = ("joint_pos", "gravity", "angvel", "action", "command")
"""Order of the terms; each term's whole history comes before the next term's."""


@flax.struct.dataclass
class Sample:
    """What the actor sees of one control step; also, with a time axis, the history.

    Attributes:
        joint_pos: joint angles minus the reference angles [rad].
        gravity: unit vector of gravity in the palm frame, as the IMU tells it.
        angvel: angular velocity in the palm frame [rad/s], as the IMU tells it.
        action: previous clipped policy output a_t.
        command: the task's inputs; crawling: v_x, v_y [m/s] and yaw rate [rad/s].
    """

    joint_pos: Float[Array, "*t 20"]
    gravity: Float[Array, "*t 3"]
    angvel: Float[Array, "*t 3"]
    action: Float[Array, "*t 20"]
    command: Float[Array, "*t inputs"]


def start_history(sample: Sample) -> Sample:
    """History at an episode's start: the first sample, eight times."""
    return Sample(**{k: jnp.tile(x, (HISTORY, 1)) for k, x in vars(sample).items()})


def push(history: Sample, sample: Sample) -> Sample:
    """Drops the oldest sample and appends a new one."""
    newest = vars(sample)
    return Sample(
        **{
            k: jnp.concatenate([x[1:], newest[k][None]])
            for k, x in vars(history).items()
        }
    )


def flatten(history: Sample) -> Float[Array, " n"]:
    """The observation vector, [8 × joint_pos, 8 × gravity, …, 8 × command]."""
    return jnp.concatenate([getattr(history, name).reshape(-1) for name in TERMS])
