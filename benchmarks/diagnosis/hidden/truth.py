"""What is really going on in a hidden mechanism: parameters of its joints and effects.

The hidden simulator knows nothing of the product's effects. Names of fields follow the
catalogue's identifiers so that a verdict can be compared with the truth; every equation
behind them is written again in this folder, where possible in another form.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

OUTSIDE = ("gear_ripple", "cable_slack", "packet_reorder", "contact_catch")
"""Effects that the catalogue does not have."""


@dataclass(frozen=True)
class Joint:
    """One joint: its servo, its command path and its effects by name.

    Attributes:
        kp, kd: gains [N·m/rad], [N·m·s/rad].
        armature: inertia of rotor and gears at the joint [kg·m²].
        delay_s, lowpass_hz, slew_rad_s, limit_nm: command path and torque limit.
        offset_rad: error of the encoder's zero that calibration did not remove.
        k_int, ref_rad_s: of a loop around the speed: its integral gain [N·m/rad], and
            the largest speed that the loop around the angle asks for.
        effects: parameters of hidden effects.
    """

    kp: float
    kd: float
    armature: float
    delay_s: float = 0.019
    lowpass_hz: float = 3.0
    slew_rad_s: float = math.inf
    limit_nm: float = math.inf
    offset_rad: float = 0.0
    k_int: float = 0.0
    ref_rad_s: float = math.inf
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def value(self, effect: str, name: str, default: float) -> float:
        """Returns a parameter of an effect, or what it is without the effect."""
        return self.effects.get(effect, {}).get(name, default)


@dataclass(frozen=True)
class Link:
    """One link in its parent's frame; it turns about its own axis `axis`."""

    name: str
    pos: tuple[float, float, float]
    quat: tuple[float, float, float, float]
    axis: tuple[float, float, float]
    mass: float
    com: tuple[float, float, float]
    inertia_quat: tuple[float, float, float, float]
    inertia: tuple[float, float, float]
    range_rad: tuple[float, float]
    parent: str = "world"


@dataclass(frozen=True)
class Mechanism:
    """Links with their joints, and how the base stands.

    Attributes:
        links, joints: in the same order, one joint for each link.
        base_quat_w: orientation of the base (w, x, y, z).
        payload_kg: mass added to each link, at its centre of mass.
        payload_shift_m: way of the last link's centre of mass along its x.
        tilt_rad: turns of gravity about the world's x and y that nobody knows of.
        sag_ohm: volts lost per newton metre of all drives together.
    """

    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    base_quat_w: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    payload_kg: tuple[float, ...] = ()
    payload_shift_m: float = 0.0
    tilt_rad: tuple[float, float] = (0.0, 0.0)
    sag_per_nm: float = 0.0

    def with_joint(self, index: int, joint: Joint) -> "Mechanism":
        """Returns a copy with another joint at `index`."""
        joints = (*self.joints[:index], joint, *self.joints[index + 1 :])
        return replace(self, joints=joints)

    def with_effect(self, index: int, name: str, **parameters: float) -> "Mechanism":
        """Returns a copy whose joint `index` also has an effect."""
        joint = self.joints[index]
        effects = {**joint.effects, name: parameters}
        return self.with_joint(index, replace(joint, effects=effects))
