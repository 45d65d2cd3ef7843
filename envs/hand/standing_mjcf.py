"""The hand as one MJCF file, for simulators outside this package."""

import numpy as np

from envs.hand.hand_file import HandFile
from envs.hand.model import build_spec
from envs.hand.stance import stance_of


def standing_mjcf(hand: HandFile) -> str:
    """Returns the hand on the floor as MJCF, with the key frame `stance`.

    The key frame holds the settled pose and the targets that hold it. Delay, command
    filter and speed limit are no part of MJCF: who simulates adds them, as
    `fingers-deploy run --driver sim` does from the policy's manifest.

    Args:
        hand: masses, servo gains, limits and friction.
    """
    stance = stance_of(hand)
    spec = build_spec(hand, np.array(stance.q_off))
    spec.add_key(name="stance", qpos=stance.qpos, ctrl=stance.target_rad)
    spec.compile()
    return spec.to_xml()
