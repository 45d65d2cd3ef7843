"""Reward tables of the crawl task: the paper's, the stock one, and one that steers.

The signals that the rows bind are attributes of `envs.signals.Signals`, and five extras
that the caller adds (`envs.tasks.gait`): `footprint_target_v` (from `footprint_step`),
`lift_magnitude` (from `lift_step`), `air_time_magnitude` (from `air_time_step`),
`mean_error_v` (from `mean_error_step`) and `gravity_v`, the unit vector of gravity in
V.
"""

from rewards.compose import RewardTable, RewardTerm, precomputed
from rewards.contact import undesired_contact
from rewards.direction import swing_against_command
from rewards.effort import joint_acceleration, torque
from rewards.footprint import footprint_departure
from rewards.mean_velocity import track_mean_planar_velocity, track_mean_yaw_rate
from rewards.motion import roll_pitch_rate, vertical_velocity
from rewards.posture import flat_orientation
from rewards.schedules import GeometricDecay, StepSwitch
from rewards.smoothness import action_rate
from rewards.tracking import track_planar_velocity, track_yaw_rate

CURRICULUM_STEPS = 18_000
"""Control steps per environment after which yaw tracking enters and lift decays."""

_PLANAR_TRACKING = RewardTerm(
    "track_planar_velocity", track_planar_velocity, 1.0, ("vel_v", "command")
)
EFFORT: RewardTable = (
    RewardTerm("action_rate", action_rate, -0.01, ("action", "previous_action")),
    RewardTerm("torque", torque, -2.5e-5, ("torque_nm",)),
    RewardTerm("joint_acceleration", joint_acceleration, -2.5e-7, ("joint_acc",)),
)
"""Rows that every task has."""

REGULARIZERS: RewardTable = (
    RewardTerm("undesired_contact", undesired_contact, -1.0, ("link_contact",)),
    RewardTerm("vertical_velocity", vertical_velocity, -2.0, ("vel_v",)),
    RewardTerm("roll_pitch_rate", roll_pitch_rate, -0.05, ("angvel_v",)),
    *EFFORT,
)
"""Rows of every task in which the hand stands."""


def _yaw_tracking(weight: float | StepSwitch) -> RewardTerm:
    """Row of yaw tracking, the one shared term whose weights differ."""
    return RewardTerm("track_yaw_rate", track_yaw_rate, weight, ("angvel_v", "command"))


CRAWL: RewardTable = (
    _PLANAR_TRACKING,
    _yaw_tracking(StepSwitch(before=0.0, after=0.5, at_steps=CURRICULUM_STEPS)),
    RewardTerm(
        "footprint", footprint_departure, -30.0, ("tip_pos_v", "footprint_target_v")
    ),
    RewardTerm(
        "lift",
        precomputed,
        GeometricDecay(
            start=6.25, ratio=0.1, hold_steps=CURRICULUM_STEPS, decay_steps=36_000
        ),
        ("lift_magnitude",),
    ),
    RewardTerm(
        "direction",
        swing_against_command,
        -0.5,
        ("tip_vel_v", "tip_force_n", "command"),
    ),
    *REGULARIZERS,
)
"""The paper's crawl reward (paper, table of training settings)."""

STEERING: RewardTable = (
    *CRAWL,
    RewardTerm(
        "track_mean_planar_velocity", track_mean_planar_velocity, 0.5, ("mean_error_v",)
    ),
    RewardTerm(
        "track_mean_yaw_rate",
        track_mean_yaw_rate,
        StepSwitch(before=0.0, after=1.0, at_steps=CURRICULUM_STEPS),
        ("mean_error_v",),
    ),
)
"""The paper's reward and, ours, what makes the mean velocity obey the command."""

STOCK: RewardTable = (
    _PLANAR_TRACKING,
    _yaw_tracking(0.5),
    RewardTerm("feet_air_time", precomputed, 0.5, ("air_time_magnitude",)),
    RewardTerm("flat_orientation", flat_orientation, -5.0, ("gravity_v",)),
    *REGULARIZERS,
)
"""Isaac Lab's ANYmal-D flat velocity task with its published weights, on the hand.

The tracking widths are those of the crawl task: Isaac Lab's 0.5 m/s would pay a hand
that stands still almost in full. Isaac Lab's flat task has no foot slide; a row with
`foot_slide` can be added (`STOCK + (RewardTerm("foot_slide", ...),)`).
"""
