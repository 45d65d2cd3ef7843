"""Reaching a stance: level palm, height of the palm and joint pose."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from rewards.shaping import Scalar, tracking_kernel

HEIGHT_WIDTH_M = 0.10
"""Width of the height kernel [m]; ours. A palm on the floor is 0.1 m too low: with half
of this width, rising from there would pay nothing."""

RISING_WIDTH_M = 0.08
"""Width of the height kernel of a hand that gets up [m]; ours. The middle of a palm on
the floor is 0.08 m too low."""

POSE_WIDTH_RAD = 0.5
"""Width of the pose kernel as a root mean square over the joints [rad]; ours."""


def palm_tilt(gravity_v: Float[Array, "3"]) -> Float[Array, ""]:
    """Tilt θ of the palm away from its level stance, 1 − cos θ = 1 + g_z.

    Unlike sin² θ it also grows beyond 90°, where a fallen hand begins.

    Args:
        gravity_v: unit vector of gravity in V.

    Returns:
        Magnitude, dimensionless, in [0, 2].

    Source:
        Paper, fall recovery (palm tilt away from level); the shape is ours.
    """
    return 1.0 + gravity_v[2]


def stance_height(
    height_m: Float[Array, ""],
    stance_height_m: Float[Array, ""],
    width_m: Scalar = HEIGHT_WIDTH_M,
) -> Float[Array, ""]:
    """Closeness to the stance's height, exp(−(z − z*)²/w²).

    Args:
        height_m: height z of the palm's origin above the floor [m].
        stance_height_m: its height z* in the stance [m].
        width_m: w [m].

    Returns:
        Magnitude in (0, 1].

    Source:
        Paper, fall recovery (reaching the crawl-stance height); the shape is ours.
    """
    return tracking_kernel((height_m - stance_height_m)[None], width_m)


def level_height(
    height_m: Float[Array, ""],
    stance_height_m: Float[Array, ""],
    gravity_v: Float[Array, "3"],
    width_m: Scalar = RISING_WIDTH_M,
) -> Float[Array, ""]:
    """Closeness to the stance's height of a hand that gets up, l² exp(−(z − z*)²/w²).

    l = (1 + cos θ)/2 = (1 − g_z)/2 is 1 when level and 1/2 on the side. Without it, a
    hand on its side, whose middle is high, is paid for staying there; with the origin
    of the palm at the wrist in the place of its middle, one that lies flat is paid for
    no way up, since the knuckles must rise before the wrist can.

    Args:
        height_m: height z of the palm's middle above the floor [m].
        stance_height_m: its height z* in the stance [m].
        gravity_v: unit vector of gravity in V.
        width_m: w [m].

    Returns:
        Magnitude in [0, 1].

    Source:
        Paper, fall recovery (reaching the crawl-stance height); shape and gate are
        ours.
    """
    level = 0.5 * (1.0 - gravity_v[2])
    return level**2 * stance_height(height_m, stance_height_m, width_m)


def stance_pose(
    joint_pos: Float[Array, " joints"],
    stance_joint_pos: Float[Array, " joints"],
    gravity_v: Float[Array, "3"],
    width_rad: Scalar = POSE_WIDTH_RAD,
) -> Float[Array, ""]:
    """Closeness to the stance's joints of an upright hand, c⁸ exp(−mean (q − q*)²/w²).

    c = max(0, −g_z) = max(0, cos θ) is 1 when level. Without it, a hand that takes the
    pose while it lies on its side would be paid for staying there; with c² a palm that
    lies flat, 36° from its stance, still is (0.65 against 0.18), and stays.

    Args:
        joint_pos: joint angles q [rad].
        stance_joint_pos: joint angles q* of the stance [rad].
        gravity_v: unit vector of gravity in V.
        width_rad: w [rad].

    Returns:
        Magnitude in [0, 1].

    Source:
        Paper, fall recovery (reaching the crawl-stance joint pose); shape and gate are
        ours.
    """
    joints = joint_pos.shape[-1]
    near = tracking_kernel((joint_pos - stance_joint_pos) / jnp.sqrt(joints), width_rad)
    return jnp.maximum(0.0, -gravity_v[2]) ** 8 * near
