"""Settings of domain randomization."""

from dataclasses import dataclass, field

from envs.errors import check_ordered


@dataclass(frozen=True)
class RandomizeConfig:
    """Ranges of the draws; `no_randomization` gives the nominal hand.

    Attributes:
        tip_friction: sliding friction of all fingertips.
        gain_scale: factor on each joint's stiffness and, drawn apart, its damping.
        effort_scale: factor on all torque limits.
        payload_com_m: largest offset of the payload's centre of mass along the back
            (both directions) and away from it.
        payload_mass_scale: factor on the payload's mass and inertia; nearly nothing for
            a first stage without the dorsal module (ours).
        palm_mass_scale: factor on the palm's mass and inertia (ours).
        palm_com_m: largest offset of the palm's centre of mass, each axis (ours).
        imu_tilt_rad: largest mounting error of the IMU about each axis (ours).
        gyro_bias_rps: largest constant error of the gyro, each axis (ours).
        joint_noise_rad: largest uniform noise of each joint angle that is read (ours).
        gravity_noise: largest uniform noise of each component of the direction of
            gravity that is read (ours).
        gyro_noise_rps: largest uniform noise of each component of the angular
            velocity that is read (ours).
    """

    tip_friction: tuple[float, float] = field(
        default=(0.30, 1.30), metadata={"unit": "1", "low": 0.0}
    )
    gain_scale: tuple[float, float] = field(
        default=(0.78, 1.22), metadata={"unit": "1", "low": 0.01}
    )
    effort_scale: tuple[float, float] = field(
        default=(1.0, 1.5), metadata={"unit": "1", "low": 0.01}
    )
    payload_com_m: tuple[float, float] = field(
        default=(0.010, 0.015), metadata={"unit": "m", "low": 0.0}
    )
    payload_mass_scale: tuple[float, float] = field(
        default=(1.0, 1.0), metadata={"unit": "1", "low": 1e-3}
    )
    palm_mass_scale: tuple[float, float] = field(
        default=(0.9, 1.1), metadata={"unit": "1", "low": 0.01}
    )
    palm_com_m: float = field(default=0.005, metadata={"unit": "m", "low": 0.0})
    imu_tilt_rad: float = field(default=0.03, metadata={"unit": "rad", "low": 0.0})
    gyro_bias_rps: float = field(default=0.05, metadata={"unit": "rad/s", "low": 0.0})
    joint_noise_rad: float = field(default=0.005, metadata={"unit": "rad", "low": 0.0})
    gravity_noise: float = field(default=0.01, metadata={"unit": "1", "low": 0.0})
    gyro_noise_rps: float = field(default=0.05, metadata={"unit": "rad/s", "low": 0.0})

    def __post_init__(self) -> None:
        masses = ("payload_mass_scale", "palm_mass_scale")
        check_ordered(self, "tip_friction", "gain_scale", "effort_scale", *masses)


def no_randomization(tip_friction: float) -> RandomizeConfig:
    """The nominal hand: every range is a point and every noise zero."""
    one = (1.0, 1.0)
    return RandomizeConfig(
        (tip_friction, tip_friction), one, one, (0.0, 0.0), one, one, *([0.0] * 6)
    )
