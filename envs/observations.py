"""The actor's observation: terms with eight samples each, oldest to newest."""

from dataclasses import dataclass, field

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

HISTORY = 8
TERMS = ("joint_pos", "gravity", "angvel", "action")
"""Order of the terms of every task; those of the task's inputs come after them."""


@dataclass(frozen=True)
class InputTerm:
    """One term of a task's inputs.

    Attributes:
        name: key in `Sample.inputs`, and name in the manifest of a policy.
        size: entries of one sample.
        frame: frame in which they are expressed.
        unit: their unit.
        ranges: lowest and highest value of each entry in training, for a command that
            an operator steers; empty for any other.
    """

    name: str
    size: int
    frame: str
    unit: str
    ranges: tuple[tuple[float, float], ...] = field(default=())


@flax.struct.dataclass
class Sample:
    """What the actor sees of one control step; also, with a time axis, the history.

    Attributes:
        joint_pos: joint angles minus the reference angles [rad].
        gravity: unit vector of gravity in the palm frame, as the IMU measures it.
        angvel: angular velocity in the palm frame [rad/s], as the IMU measures it.
        action: previous clipped policy output a_t.
        inputs: the task's inputs by name of their term.
    """

    joint_pos: Float[Array, "*t joints"]
    gravity: Float[Array, "*t 3"]
    angvel: Float[Array, "*t 3"]
    action: Float[Array, "*t joints"]
    inputs: dict[str, Float[Array, "*t n"]] = flax.struct.field(default_factory=dict)


def start_history(sample: Sample) -> Sample:
    """History at an episode's start: the first sample, eight times."""
    return jax.tree.map(lambda x: jnp.tile(x, (HISTORY, 1)), sample)


def push(history: Sample, sample: Sample) -> Sample:
    """Drops the oldest sample and appends a new one.

    Examples:
        >>> zero = Sample(*(jnp.zeros(n) for n in (20, 3, 3, 20)))
        >>> history = start_history(zero)
        >>> history = push(history, zero.replace(gravity=jnp.array([0.0, 0.0, -1.0])))
        >>> print(history.gravity.shape, history.gravity[-1])
        (8, 3) [ 0.  0. -1.]
    """
    return jax.tree.map(
        lambda kept, newest: jnp.concatenate([kept[1:], newest[None]]), history, sample
    )


def flatten(history: Sample, input_terms: tuple[InputTerm, ...]) -> Float[Array, " n"]:
    """The observation vector o = [8 × joint_pos, 8 × gravity, …, 8 × last input term].

    Args:
        history: eight samples of each term, oldest first.
        input_terms: the task's terms, in their order.

    Returns:
        All entries in one vector, each in the unit of its term ([rad], [rad/s], [1]).

    Source:
        Paper, policy interfaces.
    """
    common = [getattr(history, name) for name in TERMS]
    inputs = [history.inputs[term.name] for term in input_terms]
    return jnp.concatenate([x.reshape(-1) for x in (*common, *inputs)])
