"""Where the hand stands before the keyboard, and which finger presses.

The middle finger presses: its tip hovers over the arrow keys while thumb, index, ring
and little finger stand on the table in front of the case. The paper names no finger. A
search over postures (static margin of the four supports, joint travel to the four keys,
clearance to the case) found the same reach with index, middle and ring finger, 0.22,
0.21 and 0.22 rad to the farthest key; the middle finger has supports on both sides.
The hand stands diagonally at the keyboard's right front corner, Right nearest to it.
"""

import numpy as np

from envs.hand.figures import FINGERS
from envs.hand.hand_file import HandFile
from envs.hand.stance import Stance, load_stance, stance_of
from envs.tasks.keyboard.model import Placement

FINGER = "middle"
FINGER_INDEX = FINGERS.index(FINGER)
SUPPORTS = tuple(i for i in range(len(FINGERS)) if i != FINGER_INDEX)
"""The other fingers, by their place in `FINGERS`."""

PLACEMENT = Placement(x_w=0.1335, y_w=0.0117, yaw_w=-0.7223 - np.pi / 2)
"""The keyboard for a hand in its stance, with the palm over the world's origin and V
along world x."""


def keyboard_stance(hand: HandFile) -> Stance:
    """The stance before the keyboard, settled anew for another hand.

    Raises:
        InputError: the hand does not stand in it.
    """
    return stance_of(hand, load_stance("envs.tasks.keyboard"))
