"""Where the hand stands before the keyboard, and which finger presses.

The middle finger presses: its tip hovers over the arrow keys while thumb, index, ring
and little finger stand on the table in front of the case. The paper names no finger. A
search over postures (static margin of the four supports, joint travel to the four keys,
clearance to the case) found the same reach with index, middle and ring finger, 0.22,
0.21 and 0.22 rad to the farthest key; the middle finger has supports on both sides.
The hand stands diagonally at the keyboard's right front corner, Right nearest to it.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.errors import InputError
from envs.hand.hand_file import HandFile
from envs.hand.nominal import FINGERS, vendor_hand
from envs.hand.stance import Stance, load_stance, stance_of
from envs.rotations import multiply, rotate, unrotate
from envs.tasks.keyboard.model import Placement

FINGER = "middle"
FINGER_INDEX = FINGERS.index(FINGER)
SUPPORTS = tuple(i for i in range(len(FINGERS)) if i != FINGER_INDEX)
"""The other fingers, by their place in `FINGERS`."""

JOINTS = slice(4 * FINGER_INDEX, 4 * FINGER_INDEX + 4)
"""The pressing finger's joints among the 20."""
TIP_RADIUS_M = 0.0075

PLACEMENT = Placement(x_w=0.1335, y_w=0.0117, yaw_w=-0.7223 - np.pi / 2)
"""The keyboard for a hand in its stance, with the palm over the world's origin and V
along world x."""


def keyboard_stance(hand: HandFile) -> Stance:
    """The stance before the keyboard, settled anew for another hand.

    Raises:
        InputError: the hand has a shape of its own, or does not stand in the stance.
    """
    if hand.description:
        valid = "none: the task computes its fingertip with the vendor's dimensions"
        raise InputError("hand file", "description", "the description of a hand", valid)
    return stance_of(hand, load_stance("envs.tasks.keyboard"))


def fingertip_v(
    joint_pos: Float[Array, " joints"], q_off: Float[Array, "4"]
) -> Float[Array, "3"]:
    """Centre of the pressing fingertip relative to the palm's origin, in V.

    p = q_off* ⊗ (T_1(θ_1) … T_4(θ_4) p_tip) ⊗ q_off, with T_i the fixed transform of
    link i followed by the rotation θ_i about its joint.

    Args:
        joint_pos: joint angles θ [rad].
        q_off: rotation from the palm to V, w x y z.

    Returns:
        Position p [m].

    Source:
        Paper, keyboard pressing (encoder-based forward kinematics).
    """
    links = vendor_hand().links[JOINTS]
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
