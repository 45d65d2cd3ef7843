"""Settings that every task has, and those of tasks in which the hand stands."""

from dataclasses import dataclass, field

from envs.config.settings.randomize import RandomizeConfig
from envs.errors import InputError

PHYSICS_DT_S = 0.005
"""Time step of the physics, on every backend [s]."""
UNIT = "unit"
"""Measure of an episode that numbers what it belongs to; units are independent.

Where a task has it, an evaluation averages over each unit first.
"""


@dataclass(frozen=True)
class HandSettings:
    """Settings that every task has; a task inherits them and adds its own.

    Attributes:
        episode_s: episode length (paper).
        control_dt_s: control interval (paper: 50 Hz).
        action_scale_rad: α, joint-target increment at full action (paper, by task).
        action_clip: the policy output is clipped to ± this (ours; the paper clips
            without giving the bound).
        curriculum_scale: factor on the steps of the reward schedules; 1 is the
            paper's, which is made for 8,000 iterations of 24 steps.
        schedule_scale: a further factor for the schedule of single rows, by name.
        weights: reward weights that replace the start value of the table's.
        randomize: domain randomization.
        contacts_per_world: room on the warp backend for contacts, and for pairs of
            geoms that are near each other: the mean over all worlds, which share it.
            What does not fit is dropped, and reported (`envs.physics.room`).
        constraints_per_world: room on the warp backend for constraint rows of limits,
            friction losses and contacts: the most that one world has. What does not
            fit is dropped, and reported.
    """

    episode_s: float = field(
        default=20.0, metadata={"unit": "s", "low": 0.1, "high": 1e6}
    )
    control_dt_s: float = field(default=0.02, metadata={"unit": "s", "low": 0.005})
    action_scale_rad: float = field(default=0.060, metadata={"unit": "rad", "low": 0.0})
    action_clip: float = field(default=1.5, metadata={"unit": "1", "low": 0.1})
    curriculum_scale: float = field(default=1.0, metadata={"unit": "1", "low": 1e-3})
    schedule_scale: dict[str, float] = field(
        default_factory=dict, metadata={"unit": "1", "low": 1e-3}
    )
    weights: dict[str, float] = field(default_factory=dict)
    randomize: RandomizeConfig = field(default_factory=RandomizeConfig)
    contacts_per_world: int = field(default=48, metadata={"low": 1, "free": True})
    constraints_per_world: int = field(default=128, metadata={"low": 1, "free": True})

    def __post_init__(self) -> None:
        check_interval(self.control_dt_s)


@dataclass(frozen=True)
class UprightSettings(HandSettings):
    """Settings of a task in which the hand stands; the common ones: `HandSettings`.

    Attributes:
        max_roll_deg: tilt of V to a side that ends the episode (paper).
        max_pitch_deg: tilt of V forward or back that ends the episode (paper).
        reset_joint_rad: largest joint offset at reset (ours).
    """

    max_roll_deg: float = field(default=35.0, metadata={"unit": "deg", "low": 1.0})
    max_pitch_deg: float = field(default=30.0, metadata={"unit": "deg", "low": 1.0})
    reset_joint_rad: float = field(default=0.05, metadata={"unit": "rad", "low": 0.0})


def check_interval(control_dt_s: float) -> None:
    """Checks that a control interval is a whole number of physics steps.

    Raises:
        InputError: it is not, or is shorter than one.
    """
    substeps = control_dt_s / PHYSICS_DT_S
    if round(substeps) < 1 or abs(substeps - round(substeps)) > 1e-6:
        valid = f"a multiple of {PHYSICS_DT_S:g} s, the physics step"
        raise InputError("configuration", "control_dt_s", control_dt_s, valid)
