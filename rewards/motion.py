"""Unwanted motion of the body: heave, roll rate and pitch rate."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def vertical_velocity(vel_v: Float[Array, "3"]) -> Float[Array, ""]:
    """Squared vertical velocity of the palm, v_z².

    Args:
        vel_v: linear velocity of the palm in V [m/s].

    Returns:
        Magnitude [m²/s²], ≥ 0.

    Source:
        Paper, v_z; Isaac Lab, `lin_vel_z_l2`.
    """
    return jnp.square(vel_v[2])


def roll_pitch_rate(angvel_v: Float[Array, "3"]) -> Float[Array, ""]:
    """Squared roll and pitch rate of the palm, ω_x² + ω_y².

    Args:
        angvel_v: angular velocity of the palm in V [rad/s].

    Returns:
        Magnitude [rad²/s²], ≥ 0.

    Source:
        Paper, ω_xy; Isaac Lab, `ang_vel_xy_l2`.
    """
    return jnp.sum(jnp.square(angvel_v[:2]))
