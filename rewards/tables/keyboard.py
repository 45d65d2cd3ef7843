"""Reward table of keyboard pressing.

The rows bind attributes of `envs.signals.Signals` and the task's own signals, see
`envs.tasks.keyboard.task.Keyboard.scene_signals`. The paper names the goals and
penalties and gives no weight; all weights are ours. Rows of single events (`hit`,
`wrong`, `stray`, `stance_lost`) are paid once: at an interval of 20 ms a weight of 250
is 5 per event.

A pending request costs by distance and ends with the first key event, right or wrong.
The wrong key must cost more than the rest of the time would, and more once the hand
knows where the keys are.
"""

from rewards.compose import RewardTable, RewardTerm, precomputed
from rewards.contact import foot_slide, shear_excess
from rewards.keyboard import (
    fingertip_distance,
    keys_touched,
    other_depth,
    requested_depth,
    support_contact,
    support_drift,
)
from rewards.posture import flat_orientation
from rewards.schedules import StepSwitch
from rewards.tables.crawl import REGULARIZERS

PRECISION_STEPS = 12_000
"""Control steps per environment after which wrong keys cost more; ours."""

_DEPTHS = ("key_depth_m", "key_actuation_m", "requested")
_WRONG = StepSwitch(before=-150.0, after=-400.0, at_steps=PRECISION_STEPS)

KEYBOARD: RewardTable = (
    RewardTerm("approach", fingertip_distance, -4.0, ("goal_offset_m", "asked")),
    RewardTerm("depth", requested_depth, 1.0, _DEPTHS),
    RewardTerm("hit", precomputed, 250.0, ("hit",)),
    RewardTerm("support", support_contact, 0.5, ("support_force_n",)),
    RewardTerm("hover", fingertip_distance, -0.5, ("hover_offset_m", "idle")),
    RewardTerm("wrong", precomputed, _WRONG, ("wrong",)),
    RewardTerm("stray", precomputed, _WRONG, ("stray",)),
    RewardTerm("other_depth", other_depth, -1.0, _DEPTHS),
    RewardTerm("keycap_contact", keys_touched, -2.0, ("key_touched",)),
    RewardTerm("stance_lost", precomputed, -500.0, ("stance_lost",)),
    RewardTerm("drift", support_drift, -30.0, ("support_pos_w", "support_start_w")),
    RewardTerm("slide", foot_slide, -1.0, ("support_vel_w", "support_force_n")),
    RewardTerm("shear", shear_excess, 0.0, ("support_shear_n", "support_force_n")),
    RewardTerm("tilt", flat_orientation, -2.0, ("gravity_v",)),
    *REGULARIZERS,
)
"""The goals and penalties of keyboard pressing (paper) with weights of ours."""
