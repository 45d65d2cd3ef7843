"""Forward kinematics of the pressing finger: from joint angles to its tip in V."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.hand.figures import figures
from envs.rotations import multiply, rotate, unrotate
from envs.tasks.keyboard.stance import FINGER_INDEX

JOINTS = slice(4 * FINGER_INDEX, 4 * FINGER_INDEX + 4)
"""The finger's joints among the 20."""
TIP_RADIUS_M = 0.0075


def fingertip_v(
    joint_pos: Float[Array, "20"], q_off: Float[Array, "4"]
) -> Float[Array, "3"]:
    """Centre of the pressing fingertip relative to the palm's origin, in V [m].

    Args:
        joint_pos: joint angles [rad].
        q_off: rotation from the palm to V, w x y z.

    Source:
        Paper, keyboard pressing (encoder-based forward kinematics).
    """
    links = figures().links[JOINTS]
    pos, quat = jnp.zeros(3), jnp.array([1.0, 0.0, 0.0, 0.0])
    for link, angle in zip(links, joint_pos[JOINTS], strict=True):
        pos = pos + rotate(quat, jnp.array(link.pos))
        quat = multiply(multiply(quat, jnp.array(link.quat)), _about_y(angle))
    tip = links[-1].tip
    assert tip is not None
    return unrotate(q_off, pos + rotate(quat, jnp.array(np.array(tip))))


def _about_y(angle: Float[Array, ""]) -> Float[Array, "4"]:
    """Rotation about the joint's axis, +y of its link."""
    zero = jnp.zeros(())
    return jnp.stack([jnp.cos(angle / 2), zero, jnp.sin(angle / 2), zero])
