"""Pushing an object to a target: reach it, bring it nearer, keep it there."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from rewards.shaping import Scalar, tracking_kernel

REACH_WIDTH_M = 0.08
"""Width of the kernel of reaching the object [m]; ours."""

TARGET_WIDTH_M = 0.03
"""Width of the kernel of keeping the object at its target [m]; ours."""

DELIVERED_M = 0.02
"""Distance within which an object has arrived [m] (paper)."""


def object_reached(
    pocket_to_object_m: Float[Array, "2"], width_m: Scalar = REACH_WIDTH_M
) -> Float[Array, ""]:
    """Closeness of the object to where the hand pushes it, exp(−|e|²/w²).

    Args:
        pocket_to_object_m: way e from that place to the object's centre, planar [m].
        width_m: w [m].

    Returns:
        Magnitude in (0, 1].

    Source:
        Paper, pushing (approaching the object); the shape is ours.
    """
    return tracking_kernel(pocket_to_object_m, width_m)


def object_progress(progress_mps: Float[Array, ""]) -> Float[Array, ""]:
    """Speed at which the object nears its target, m = max(0, −ḋ).

    With `object_regress` at the opposite weight, the sum over an episode is that of a
    potential: what is gained by a distance is lost by going back.

    Args:
        progress_mps: −ḋ, the decrease of the distance over the control step [m/s].

    Returns:
        Magnitude [m/s], ≥ 0.

    Source:
        Paper, pushing (moving it toward the target); the shape is ours.
    """
    return jnp.maximum(progress_mps, 0.0)


def object_regress(progress_mps: Float[Array, ""]) -> Float[Array, ""]:
    """Speed at which the object moves away from its target, m = max(0, ḋ).

    Args:
        progress_mps: −ḋ, the decrease of the distance over the control step [m/s].

    Returns:
        Magnitude [m/s], ≥ 0.

    Source:
        As `object_progress`.
    """
    return jnp.maximum(-progress_mps, 0.0)


def object_at_target(
    target_error_m: Float[Array, ""], width_m: Scalar = TARGET_WIDTH_M
) -> Float[Array, ""]:
    """Closeness of the object to its target, exp(−d²/w²).

    Args:
        target_error_m: planar distance d [m].
        width_m: w [m].

    Returns:
        Magnitude in (0, 1].

    Source:
        Paper, pushing (keeping it there); the shape is ours.
    """
    return tracking_kernel(target_error_m[None], width_m)


def object_delivered(target_error_m: Float[Array, ""]) -> Float[Array, ""]:
    """1 while the object is within 2 cm of its target, else 0: m = [d < 2 cm].

    Args:
        target_error_m: planar distance d [m].

    Returns:
        Magnitude, 0 or 1.

    Source:
        Paper, delivery; ours to pay for it.
    """
    return (target_error_m < DELIVERED_M).astype(jnp.float32)
