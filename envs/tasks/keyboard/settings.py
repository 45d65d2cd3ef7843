"""Settings of keyboard pressing."""

from dataclasses import dataclass, field

from envs.scoring import check_rows
from envs.tasks.keyboard.requests import RequestConfig, check_requests
from envs.tasks.keyboard.variation import KeyboardVariation
from envs.tasks.upright import UprightSettings
from rewards import KEYBOARD


@dataclass(frozen=True)
class KeyboardConfig(UprightSettings):
    """Settings of keyboard pressing; the others are those of `UprightSettings`.

    The tilt of V that is a loss of stance is that of crawling (ours).

    Attributes:
        max_drift_m: mean displacement of the supporting tips that is a loss of stance
            (ours).
        requests: when keys are asked for.
        keyboard: what differs from keyboard to keyboard.
    """

    action_scale_rad: float = field(default=0.028, metadata={"unit": "rad", "low": 0.0})
    reset_joint_rad: float = field(default=0.02, metadata={"unit": "rad", "low": 0.0})
    max_drift_m: float = field(default=0.03, metadata={"unit": "m", "low": 1e-3})
    requests: RequestConfig = field(default_factory=RequestConfig)
    keyboard: KeyboardVariation = field(default_factory=KeyboardVariation)
    # Warp's pool also holds pairs of links and keys that are only near each other.
    contacts_per_world: int = field(default=96, metadata={"low": 1, "free": True})

    def __post_init__(self) -> None:
        super().__post_init__()
        check_rows(KEYBOARD, self.weights, self.schedule_scale)
        check_requests(self.requests, self.control_dt_s)
