"""Settings of object pushing."""

from dataclasses import dataclass, field

from envs.errors import check_ordered
from envs.scoring import check_rows
from envs.tasks.push.camera import CameraConfig
from envs.tasks.upright import UprightSettings
from rewards import PUSH

Range = tuple[float, float]


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
        check_rows(PUSH, self.weights, self.schedule_scale)
        check_ordered(self, "target_m", "target_bearing_deg", "object_friction")
        check_ordered(self, "object_m", "object_bearing_deg")
