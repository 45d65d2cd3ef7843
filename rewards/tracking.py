"""Velocity tracking: planar velocity and yaw rate against the command."""

from jaxtyping import Array, Float

from rewards.shaping import Scalar, tracking_kernel

PLANAR_WIDTH_MPS = 0.10
"""Width of the planar tracking kernel [m/s] (paper, direction objective)."""

YAW_WIDTH_RADPS = 0.225
"""Width of the yaw tracking kernel [rad/s] (paper, direction objective)."""


def track_planar_velocity(
    vel_v: Float[Array, "3"],
    command: Float[Array, "3"],
    width_mps: Scalar = PLANAR_WIDTH_MPS,
) -> Float[Array, ""]:
    """Tracking of the planar command, exp(−|v_xy − v_cmd|²/w²).

    Args:
        vel_v: linear velocity of the palm in V [m/s]; the vertical part is not read.
        command: v_x, v_y [m/s] and yaw rate [rad/s] in V; the yaw rate is not read.
        width_mps: w [m/s].

    Returns:
        Magnitude in (0, 1].

    Source:
        Paper, widths; convention of `rewards.shaping.tracking_kernel`.

    Examples:
        Without error the magnitude is 1; an error of one width leaves 1/e of it.

        >>> import jax.numpy as jnp
        >>> command = jnp.array([0.16, 0.0, 0.0])
        >>> for vel_x in (0.16, 0.06):
        ...     vel_v = jnp.array([vel_x, 0.0, 0.0])
        ...     print(f"{track_planar_velocity(vel_v, command):.3f}")
        1.000
        0.368
    """
    return tracking_kernel(vel_v[:2] - command[:2], width_mps)


def track_yaw_rate(
    angvel_v: Float[Array, "3"],
    command: Float[Array, "3"],
    width_radps: Scalar = YAW_WIDTH_RADPS,
) -> Float[Array, ""]:
    """Tracking of the yaw command, exp(−(ω_z − ω_cmd)²/w²).

    Args:
        angvel_v: angular velocity of the palm in V [rad/s]; only z is read.
        command: v_x, v_y [m/s] and yaw rate [rad/s] in V; only the yaw rate is read.
        width_radps: w [rad/s].

    Returns:
        Magnitude in (0, 1].

    Source:
        Paper, widths; convention of `rewards.shaping.tracking_kernel`.
    """
    return tracking_kernel(angvel_v[2:] - command[2:], width_radps)
