"""The velocity that a pushing hand is asked for in training: around, behind, ahead.

Rewards of walking need a command. This one is worked out from the true state, which the
policy does not see: it has to find the same from the camera's samples.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from envs.rotations import multiply, rotate
from envs.tasks.push.scene import POS
from rewards import safe_norm

POCKET_V = (0.088, -0.010)
"""Where a pushed cube's centre sits in V [m]: before the ring finger, right of the
middle one (ours, from the stance)."""
TOP_SPEED_MPS = 0.12
TOP_RATE_RPS = 0.45
ARRIVED_M = 0.010
_GAIN_PER_S = 2.0
_TURN_GAIN_PER_S = 1.5
_GAP_M = 0.07
_BESIDE_M = 0.02
_ASKEW_RAD = 0.5


def guide(
    object_v: Float[Array, "2"], to_target_v: Float[Array, "2"]
) -> Float[Array, "3"]:
    """Velocity and yaw rate that bring the cube to its target, in V.

    With e the way of the pocket to the cube, u the direction of the target, e_u = e·u
    and γ = atan2(u_y, u_x):

        v = k (e − e_u u) + u (r p + (1 − r) k (e_u − 7 cm)),  ω = clip(k_ω γ, ± ω_max)
        r = exp(−‖e − e_u u‖²/w² − γ²/w_γ²),  p = min(v_max, k (d + max(e_u, 0)))

    and ‖v‖ ≤ v_max: the part of e across u is closed, and along u the hand goes ahead
    if it is behind the cube and looks along u, and otherwise to a point 7 cm behind
    the cube. It turns toward u. At the target it stands.

    Args:
        object_v: the cube's centre relative to the palm's origin, in V [m].
        to_target_v: from the cube to the target, in V [m]; d is its length.

    Returns:
        Planar velocity v [m/s] and yaw rate ω [rad/s].

    Source:
        Ours.
    """
    distance = safe_norm(to_target_v)
    along = to_target_v / jnp.maximum(distance, 1e-6)
    offset = object_v - jnp.array(POCKET_V)
    ahead = jnp.sum(offset * along)
    across = offset - ahead * along
    askew = jnp.arctan2(along[1], along[0])
    ready = jnp.exp(-jnp.sum(across**2) / _BESIDE_M**2 - jnp.square(askew / _ASKEW_RAD))
    push = jnp.minimum(TOP_SPEED_MPS, _GAIN_PER_S * (distance + jnp.maximum(ahead, 0)))
    back = _GAIN_PER_S * (ahead - _GAP_M)
    vel = _GAIN_PER_S * across + along * (ready * push + (1.0 - ready) * back)
    speed = safe_norm(vel)
    vel = vel * jnp.minimum(1.0, TOP_SPEED_MPS / jnp.maximum(speed, 1e-6))
    rate = jnp.clip(_TURN_GAIN_PER_S * askew, -TOP_RATE_RPS, TOP_RATE_RPS)
    return jnp.where(distance < ARRIVED_M, 0.0, jnp.append(vel, rate))


def guidance(
    qpos: Float[Array, " nq"], target_w: Float[Array, "2"], q_off: Float[Array, "4"]
) -> Float[Array, "3"]:
    """The guide's answer to a state, c = guide(R(−ψ)(p_o − p), R(−ψ)(g − p_o)).

    Args:
        qpos: generalized positions of hand and cube [m, rad].
        target_w: the target g on the floor [m].
        q_off: rotation from the palm to V, w x y z.

    Returns:
        v_x, v_y [m/s] and yaw rate [rad/s] in V.

    Source:
        Ours.
    """
    to_target_v = _turned(target_w - qpos[POS][:2], -heading(qpos[3:7], q_off))
    return guide(cube_v(qpos, q_off), to_target_v)


def cube_v(qpos: Float[Array, " nq"], q_off: Float[Array, "4"]) -> Float[Array, "2"]:
    """The cube relative to the palm from above, in V's heading: e = R(−ψ)(p_o − p).

    Args:
        qpos: generalized positions of hand and cube [m, rad].
        q_off: rotation from the palm to V, w x y z.

    Returns:
        x and y [m].

    Source:
        Ours.
    """
    return _turned(qpos[POS][:2] - qpos[:2], -heading(qpos[3:7], q_off))


def heading(
    palm_quat_w: Float[Array, "4"], q_off: Float[Array, "4"]
) -> Float[Array, ""]:
    """Angle of V's x axis about the vertical, ψ = atan2(x_y, x_x).

    Args:
        palm_quat_w: orientation of the palm, w x y z.
        q_off: rotation from the palm to V.

    Returns:
        ψ [rad] in (−π, π].

    Source:
        Ours.
    """
    v_quat_w = multiply(palm_quat_w, q_off)
    x, y, _ = rotate(v_quat_w, jnp.array([1.0, 0.0, 0.0]))
    return jnp.arctan2(y, x)


def _turned(
    vector: Float[Array, "2"], angle_rad: Float[Array, ""]
) -> Float[Array, "2"]:
    cos, sin = jnp.cos(angle_rad), jnp.sin(angle_rad)
    x, y = vector
    return jnp.stack([cos * x - sin * y, sin * x + cos * y])
