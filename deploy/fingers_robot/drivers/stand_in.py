"""What a hand that is not real reports of itself."""

import numpy as np

from fingers_deploy.manifest import Interface
from fingers_robot.reading import Array, DriverInfo, Health


def info_of(interface: Interface, name: str, live: bool = True) -> DriverInfo:
    """Of a hand that is not real, and is as the policy wants it."""
    limits = np.asarray(interface.joint_limits_rad, np.float64)
    lowpass_hz = interface.command_path.lowpass_hz
    return DriverInfo(name, interface.joint_names, limits, lowpass_hz, live)


def sound_health(
    t_s: float,
    enabled: bool,
    pos_rad: Array,
    temperature_c: Array | float = 40.0,
    bus_v: float = 14.8,
) -> Health:
    """A read-back without a fault, of a hand that is not real: effort limits at 1 A.

    Args:
        t_s: when it began [s].
        enabled: all joints are energized, else none.
        pos_rad: joint angles [rad], [20].
        temperature_c: joint temperatures [°C], [20] or one for all.
        bus_v: supply voltage [V].
    """
    return Health(
        t_s=t_s,
        enabled=enabled,
        disabled=not enabled,
        temperature_c=np.broadcast_to(np.asarray(temperature_c, float), pos_rad.shape),
        bus_v=bus_v,
        error_code=np.zeros(pos_rad.shape, np.uint32),
        effort_limit_a=np.ones(pos_rad.shape),
        pos_rad=pos_rad,
    )
