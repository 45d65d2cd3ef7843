"""What is known of the drives of joints: the contents of `drive.yaml`."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from envs.actuator.catalogue import effect_kind
from envs.errors import InputError, one_of

SCHEMA = 1
Effort = Literal["tau", "cur", "duty", "none"]
Part = Literal["both", "controller", "mechanics"]
UNIVERSAL = ("1", "s", "Hz", "1e-6")
"""Units of parameters whose bounds hold for a robot of any size."""
_TOLERANCE = {"low": 0.0, "high": 10.0}
"""Range of every tolerance [1]."""


@dataclass(frozen=True)
class Nominal:
    """A nominal parameter of the drive and how well it is known.

    Attributes:
        value: of the parameter.
        tolerance: largest relative deviation within the expected; for a value of zero
            in its own unit.
        free: whether nothing is known of it: a fit may choose any value.
    """

    value: float
    tolerance: float = field(default=0.05, metadata=_TOLERANCE)
    free: bool = False


@dataclass(frozen=True)
class Masses:
    """How well the masses of the MJCF file are known; their values stand there.

    Attributes:
        tolerance: largest relative deviation within the expected, of the masses and
            inertias that a joint moves, of its rotor and of the carrying body.
    """

    tolerance: float = field(default=0.05, metadata=_TOLERANCE)


@dataclass(frozen=True)
class JointDrive:
    """Drive of one joint as simulated so far.

    Attributes:
        kp: position gain [N·m/rad, or N/m].
        kd: velocity gain [N·m·s/rad, or N·s/m].
        kp_setting: name of a setting in the logs' headers that multiplies `kp`; "" if
            the gain is the same in all records.
        effort: column that holds the effort of the drive.
        effort_scale: N·m (or N) per unit of that column.
        effects: effects that the simulation has, with their parameters by name.
        known: `controller` where unknown forces push on the joint, `mechanics` where
            the law of the controller is not known: only that part is examined then.
        masses: how well those that the joint moves are known.
    """

    kp: Nominal
    kd: Nominal
    kp_setting: str = ""
    effort: Effort = "tau"
    effort_scale: Nominal = field(default_factory=lambda: Nominal(1.0, 0.02))
    effects: dict[str, dict[str, Nominal]] = field(default_factory=dict)
    known: Part = "both"
    masses: Masses = field(default_factory=Masses)

    def __post_init__(self) -> None:
        for name, parameters in self.effects.items():
            known = effect_kind(name).parameters
            for parameter in parameters:
                if parameter not in known:
                    valid = one_of(known, parameter)
                    raise InputError("drive", f"effects.{name}", parameter, valid)
                _check_range(name, parameter, parameters[parameter].value)
        for name in ("kp", "kd"):
            if not getattr(self, name).value >= 0.0:
                raise InputError("drive", name, getattr(self, name).value, "at least 0")

    def parameter(self, effect: str, name: str, absent: float) -> float:
        """Returns a parameter of an effect that the simulation has, else `absent`."""
        found = self.effects.get(effect, {}).get(name)
        return absent if found is None else found.value


def _check_range(effect: str, name: str, value: float) -> None:
    """Refuses what no robot has: bounds that know of sizes hold for the hand alone."""
    parameter = effect_kind(effect).parameters[name]
    low, high = parameter.low, parameter.high
    if parameter.unit not in UNIVERSAL:
        low, high = (0.0 if low >= 0.0 else -np.inf), np.inf
    if not (low <= value <= high or value == parameter.identity):
        valid = f"{low:g} to {high:g} {parameter.unit}".replace(" 1", "")
        raise InputError("drive", f"effects.{effect}.{name}", value, valid)


@dataclass(frozen=True)
class DriveFile:
    """`drive.yaml`: drives by joint name of the MJCF; `*` for all others."""

    schema: int
    joints: dict[str, JointDrive]

    def __post_init__(self) -> None:
        if self.schema != SCHEMA:
            raise InputError("drive", "schema", self.schema, f"{SCHEMA}")
