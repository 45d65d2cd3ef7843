"""Settings that every task of the hand has; a task inherits them and adds its own."""

from dataclasses import dataclass, field

from envs.plant import check_interval
from envs.randomize import RandomizeConfig


@dataclass(frozen=True)
class HandSettings:
    """Settings that `envs.env.HandEnv` reads.

    Attributes:
        episode_s: episode length (paper).
        control_dt_s: control interval (paper: 50 Hz).
        action_scale_rad: α, joint-target increment at full action (paper, by task).
        action_clip: the policy output is clipped to ± this (ours).
        curriculum_scale: factor on the steps of the reward schedules.
        weights: reward weights that replace the start value of the table's.
        randomize: domain randomization.
        contacts_per_world, constraints_per_world: room for contacts and constraint
            rows on the warp backend, see `make_physics`; what does not fit
            is dropped, and told (`envs.physics.room`).
    """

    episode_s: float = field(
        default=20.0, metadata={"unit": "s", "low": 0.1, "high": 1e6}
    )
    control_dt_s: float = field(default=0.02, metadata={"unit": "s", "low": 0.005})
    action_scale_rad: float = field(default=0.060, metadata={"unit": "rad", "low": 0.0})
    action_clip: float = field(default=1.5, metadata={"unit": "1", "low": 0.1})
    curriculum_scale: float = field(default=1.0, metadata={"unit": "1", "low": 1e-3})
    weights: dict[str, float] = field(default_factory=dict)
    randomize: RandomizeConfig = field(default_factory=RandomizeConfig)
    contacts_per_world: int = field(default=48, metadata={"low": 1, "free": True})
    constraints_per_world: int = field(default=128, metadata={"low": 1, "free": True})

    def __post_init__(self) -> None:
        check_interval(self.control_dt_s)
