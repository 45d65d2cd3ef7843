"""Effort of the drive: torque, acceleration, and what a supervisor would stop."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from rewards.shaping import Scalar

OVERLOAD_SHARE = 0.7
"""Share of a joint's effort limit that costs nothing [1]: a supervisor stops at 0.9."""
LAG_RAD = 0.25
"""Distance of joint and target that costs nothing [rad]: it stops at 0.5."""


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


def overload(
    effort_share: Float[Array, " joints"], allowed: Scalar = OVERLOAD_SHARE
) -> Float[Array, ""]:
    """Effort near the limit, Σ max(0, |τ|/τ_max − s).

    Args:
        effort_share: |τ|/τ_max of each joint [1].
        allowed: s [1].

    Returns:
        Magnitude [1], ≥ 0.

    Source:
        Ours, against the over-current row of the robot's supervisor.
    """
    return jnp.sum(jnp.maximum(effort_share - allowed, 0.0))


def target_lag(
    joint_lag_rad: Float[Array, " joints"], allowed_rad: Scalar = LAG_RAD
) -> Float[Array, ""]:
    """How far joints are behind their targets, Σ max(0, |θ − q| − l).

    Args:
        joint_lag_rad: |θ − q| of each joint [rad].
        allowed_rad: l [rad].

    Returns:
        Magnitude [rad], ≥ 0.

    Source:
        Ours, against the tracking row of the robot's supervisor.
    """
    return jnp.sum(jnp.maximum(joint_lag_rad - allowed_rad, 0.0))
