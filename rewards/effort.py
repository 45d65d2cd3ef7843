"""Effort of the drive: joint torque and joint acceleration."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def torque(torque_nm: Float[Array, " joints"]) -> Float[Array, ""]:
    """Sum of squared joint torques, Σ τ².

    Args:
        torque_nm: joint torques [N·m].

    Returns:
        Magnitude [N²·m²], ≥ 0.

    Source:
        Paper, joint effort; the norm is that of Isaac Lab, `joint_torques_l2`.
    """
    return jnp.sum(jnp.square(torque_nm))


def joint_acceleration(joint_acc: Float[Array, " joints"]) -> Float[Array, ""]:
    """Sum of squared joint accelerations, Σ q̈².

    Args:
        joint_acc: joint accelerations [rad/s²].

    Returns:
        Magnitude [rad²/s⁴], ≥ 0.

    Source:
        Paper, acceleration; the norm is that of Isaac Lab, `joint_acc_l2`.
    """
    return jnp.sum(jnp.square(joint_acc))
