"""Posture of the body against level."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def flat_orientation(gravity_v: Float[Array, "3"]) -> Float[Array, ""]:
    """Squared horizontal components of unit gravity in V, g_x² + g_y² = sin²(tilt).

    Zero at the nominal stance, in which V is level, and independent of the heading.

    Args:
        gravity_v: unit vector of gravity in V.

    Returns:
        Magnitude, dimensionless, in [0, 1].

    Source:
        Paper, "Design" of the ablation; Isaac Lab, `flat_orientation_l2`.
    """
    return jnp.sum(jnp.square(gravity_v[:2]))
