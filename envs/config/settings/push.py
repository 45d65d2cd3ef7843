"""Settings of object pushing."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from envs.config.settings.hand import UprightSettings
from envs.config.settings.rows import check_weights
from envs.errors import check_ordered

if TYPE_CHECKING:
    from rewards import RewardTable

Range = tuple[float, float]


@dataclass(frozen=True)
class CameraConfig:
    """What the camera does to positions; the values are the paper's unless noted.

    Attributes:
        rate_hz: frames per second.
        latency_steps: least and largest latency in control steps; drawn for each
            episode (ours).
        dropout: share of lost frames.
        position_noise_m: standard deviation of each coordinate (normal: ours).
        heading_noise_rad: standard deviation of the heading that the marker on the
            hand's back gives (ours: the paper names no noise of it).
    """

    rate_hz: float = field(default=60.0, metadata={"unit": "Hz", "low": 1.0})
    latency_steps: tuple[int, int] = field(
        default=(1, 3), metadata={"unit": "control steps", "low": 0, "high": 7}
    )
    dropout: float = field(default=0.03, metadata={"unit": "1", "low": 0.0, "high": 1})
    position_noise_m: float = field(default=0.002, metadata={"unit": "m", "low": 0.0})
    heading_noise_rad: float = field(default=0.02, metadata={"unit": "rad", "low": 0.0})

    def __post_init__(self) -> None:
        check_ordered(self, "latency_steps")


@dataclass(frozen=True)
class PushConfig(UprightSettings):
    """Settings of object pushing; the others are those of `UprightSettings`.

    Attributes:
        target_m: distance of the target from the cube (paper).
        target_bearing_deg: direction of the target, seen from the cube, against the
            hand's heading at the start (ours).
        object_m: distance of the cube from the palm's origin at the start (ours).
        object_bearing_deg: direction of the cube against the hand's heading (ours).
        object_friction: of the cube on the floor (ours).
        reset_speed_mps: largest base speed at reset, each axis (ours).
        camera: what the camera does to positions.
    """

    action_scale_rad: float = field(default=0.040, metadata={"unit": "rad", "low": 0.0})
    target_m: Range = field(default=(0.10, 0.40), metadata={"unit": "m", "low": 0.0})
    target_bearing_deg: Range = field(default=(-40.0, 40.0), metadata={"unit": "deg"})
    object_m: Range = field(default=(0.17, 0.26), metadata={"unit": "m", "low": 0.0})
    object_bearing_deg: Range = field(default=(-20.0, 20.0), metadata={"unit": "deg"})
    object_friction: Range = field(
        default=(0.2, 0.5), metadata={"unit": "1", "low": 0.0}
    )
    reset_speed_mps: float = field(default=0.05, metadata={"unit": "m/s", "low": 0.0})
    camera: CameraConfig = field(default_factory=CameraConfig)
    # The cube stands on four contacts and lies near all fingers.
    contacts_per_world: int = field(default=96, metadata={"low": 1, "free": True})
    constraints_per_world: int = field(default=224, metadata={"low": 1, "free": True})

    def __post_init__(self) -> None:
        super().__post_init__()
        check_weights(self, _table)
        check_ordered(self, "target_m", "target_bearing_deg", "object_friction")
        check_ordered(self, "object_m", "object_bearing_deg")


def _table() -> RewardTable:
    from rewards import PUSH

    return PUSH
