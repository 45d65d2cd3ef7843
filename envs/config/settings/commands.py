"""Settings of velocity commands."""

from dataclasses import dataclass, field

from envs.errors import InputError, check_ordered


@dataclass(frozen=True)
class CommandConfig:
    """Ranges of the commands in V; the ranges are the paper's.

    Attributes:
        vel_x_mps: range of the velocity forward, drawn uniformly.
        vel_y_mps: range of the velocity to the left, drawn uniformly.
        yaw_rate_rps: range of the yaw rate, positive to the left, drawn uniformly.
        resample_s: time between commands; ours, the paper only says that it happens.
        standing_fraction: share of commands that are zero; ours.
        turning_fraction: share without planar velocity; ours.
        straight_fraction: share without yaw rate; ours.
        sideways_fraction: share to the left or right alone; ours.
    """

    vel_x_mps: tuple[float, float] = field(
        default=(0.0, 0.16), metadata={"unit": "m/s"}
    )
    vel_y_mps: tuple[float, float] = field(
        default=(-0.16, 0.16), metadata={"unit": "m/s"}
    )
    yaw_rate_rps: tuple[float, float] = field(
        default=(-0.45, 0.45), metadata={"unit": "rad/s"}
    )
    resample_s: float = field(default=5.0, metadata={"unit": "s", "low": 0.02})
    standing_fraction: float = field(
        default=0.05, metadata={"unit": "1", "low": 0.0, "high": 1.0}
    )
    turning_fraction: float = field(
        default=0.0, metadata={"unit": "1", "low": 0.0, "high": 1.0}
    )
    straight_fraction: float = field(
        default=0.0, metadata={"unit": "1", "low": 0.0, "high": 1.0}
    )

    sideways_fraction: float = field(
        default=0.0, metadata={"unit": "1", "low": 0.0, "high": 1.0}
    )

    def __post_init__(self) -> None:
        check_ordered(self, "vel_x_mps", "vel_y_mps", "yaw_rate_rps")
        kinds = (self.turning_fraction, self.straight_fraction, self.sideways_fraction)
        if (shares := sum(kinds)) > 1.0:
            what = "command.turning_fraction + straight_fraction + sideways_fraction"
            raise InputError("configuration", what, f"{shares:g}", "1 at most")
