"""Reward table of fall recovery.

The rows bind attributes of `envs.signals.Signals` and four extras that the caller
adds: `gravity_v`, the unit vector of gravity in V, `height_m`, the height of the palm's
middle, and `stance_height_m` and `stance_joint_pos`, its height and the joint angles in
the crawl stance.

The paper names tilt, height and joint pose and gives no weight. All weights are ours.
Tilt alone costs little: a palm that lies flat, 39° from the stance, tilts further while
its knuckles rise, before its wrist can. A fallen hand must be free to move, so rates
and contacts of links, which it cannot avoid, cost little beside the crawl task's.
"""

from rewards.compose import RewardTable, RewardTerm
from rewards.contact import undesired_contact
from rewards.motion import roll_pitch_rate
from rewards.stance import level_height, palm_tilt, stance_pose
from rewards.tables.crawl import EFFORT

RECOVERY: RewardTable = (
    RewardTerm("palm_tilt", palm_tilt, -0.2, ("gravity_v",)),
    RewardTerm(
        "stance_height",
        level_height,
        4.0,
        ("height_m", "stance_height_m", "gravity_v"),
    ),
    RewardTerm(
        "stance_pose", stance_pose, 2.0, ("joint_pos", "stance_joint_pos", "gravity_v")
    ),
    RewardTerm("undesired_contact", undesired_contact, -0.1, ("link_contact",)),
    RewardTerm("roll_pitch_rate", roll_pitch_rate, -0.01, ("angvel_v",)),
    *EFFORT,
)
"""The goals of fall recovery (paper) with weights of ours."""
