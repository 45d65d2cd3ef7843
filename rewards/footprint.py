"""Footprint objective: virtual springs from each fingertip to its stance target."""

import flax.struct
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

AXIS_STIFFNESS = (0.25, 1.0, 1.0)
"""Diagonal of W along x (fore-aft), y and z of V (paper, eq. (1))."""


def footprint_departure(
    tip_pos_v: Float[Array, "tips 3"],
    footprint_target_v: Float[Array, "tips 3"],
    axis_stiffness: tuple[float, float, float] = AXIS_STIFFNESS,
) -> Float[Array, ""]:
    """Squared departure of the tips from the stance, Σ_j (p_j − p*_j)ᵀ W (p_j − p*_j).

    Args:
        tip_pos_v: tip positions p relative to the palm origin in V [m].
        footprint_target_v: targets p* in the same frame [m].
        axis_stiffness: diagonal of W, dimensionless.

    Returns:
        Magnitude [m²], ≥ 0; 0 exactly at the stance.

    Source:
        Paper, eq. (1).

    Examples:
        One of five tips stands 2 cm ahead of its target and 1 cm beside it; the way
        ahead counts a quarter:

        >>> tips_v = jnp.zeros((5, 3)).at[0].set(jnp.array([0.02, 0.01, 0.0]))
        >>> print(f"{footprint_departure(tips_v, jnp.zeros((5, 3))):.6f}")
        0.000200
    """
    departure = tip_pos_v - footprint_target_v
    return jnp.sum(jnp.square(departure) * jnp.asarray(axis_stiffness))


@flax.struct.dataclass
class FootprintMemory:
    """The targets of one environment; keep it over resets.

    Attributes:
        target_v: p*, tip positions relative to the palm origin in V [m].
        captured: whether `target_v` has been taken from the hand yet.
    """

    target_v: Float[Array, "*b tips 3"]
    captured: Bool[Array, "*b"]


def init_footprint_memory(tips: int = 5) -> FootprintMemory:
    """Memory of an environment whose reward was never evaluated."""
    return FootprintMemory(target_v=jnp.zeros((tips, 3)), captured=jnp.zeros((), bool))


def footprint_step(
    memory: FootprintMemory, tip_pos_v: Float[Array, "tips 3"]
) -> FootprintMemory:
    """Captures the targets at the first call and keeps them, p* ← p once, then p*.

    Call it before `footprint_departure` in each reward evaluation, and do not reset the
    memory with the episode. The magnitude of the very first evaluation is then 0.

    Args:
        memory: memory of the evaluation before.
        tip_pos_v: tip positions relative to the palm origin in V [m].

    Returns:
        Memory with `captured` set.

    Source:
        Paper, "Footprint objective": captured at the first reward evaluation after
        initialization, fixed across subsequent resets.
    """
    target_v = jnp.where(memory.captured, memory.target_v, tip_pos_v)
    return FootprintMemory(target_v=target_v, captured=jnp.ones((), bool))
