"""The velocity that a pushing hand is asked for in training: around, behind, ahead.

Rewards of walking need a command. This one is worked out from the true state, which the
policy does not see: it has to find the same from what the camera tells.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

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
    """Planar velocity [m/s] and yaw rate [rad/s] in V.

    With e the way of the pocket to the cube and u the direction of the target: the part
    of e across u is closed, and along u the hand goes ahead if it is behind the cube
    and looks along u, and otherwise to a point 7 cm behind the cube. It turns toward
    u. At the target it stands.

    Args:
        object_v: the cube's centre relative to the palm's origin, in V [m].
        to_target_v: from the cube to the target, in V [m].
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
