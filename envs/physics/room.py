"""Room for contacts and constraints, of which Warp has only as much as it is given.

What does not fit is dropped: the hand then stands on fewer contacts than it has. So
each overflow is a metric of its step, training stops at it unless asked not to, and
an evaluation in which there was one has no result.
"""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from envs.errors import InputError

ROOM = {
    "contact_overflow": "contacts_per_world",
    "constraint_overflow": "constraints_per_world",
}
"""Metric of a step whose buffer was too small -> the setting that makes room."""

CONSTRAINT_BITS = 0b11
"""`OverflowType.NEFC` and `NJMAX_NNZ` of MuJoCo Warp; other bits are of contacts."""


def overflow_metrics(bits: Int[Array, ""]) -> dict[str, Float[Array, ""]]:
    """Metrics of `ROOM`: 1 where bits ∧ mask ≠ 0, else 0 [1].

    A one means that contacts or constraints were dropped in this step.

    Args:
        bits: `PhysicsOutput.overflow` of the step.

    Source:
        MuJoCo Warp, `OverflowType`.
    """
    constraints = bits & CONSTRAINT_BITS
    found = {"contact_overflow": bits ^ constraints, "constraint_overflow": constraints}
    return {name: (value != 0).astype(jnp.float32) for name, value in found.items()}


def too_little_room(
    source: object, metric: str, config: Any, more: str = ""
) -> InputError:
    """Returns the error that names the setting to raise.

    Args:
        source: what was running, and how many worlds or episodes were hit.
        metric: one of `ROOM`.
        config: settings of the task.
        more: what else can be done.
    """
    field = ROOM[metric]
    found = getattr(config, field)
    return InputError(source, f"env.{field}", found, f"about {2 * found}{more}")
