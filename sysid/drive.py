"""What is known of the drives of joints: the contents of `drive.yaml`."""

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from envs.actuator.catalogue import effect_kind
from envs.errors import InputError, one_of

SCHEMA = 1
Effort = Literal["tau", "cur", "duty", "none"]
EFFORTS: tuple[Effort, ...] = ("tau", "cur", "duty")
"""Columns of an effort, best first; that one is read where `drive.yaml` names none."""
Part = Literal["both", "controller", "mechanics"]
UNIVERSAL = ("1", "s", "Hz", "1e-6")
"""Units of parameters whose bounds hold for a robot of any size."""
_TOLERANCE = {"low": 0.0, "high": 10.0}
"""Range of every tolerance [1]."""
NEVER_NOMINAL = ("joint_coupling", "finger_weakness")
"""Effects on joints that no simulation of one joint has: another joint, or a finger."""


@dataclass(frozen=True)
class Nominal:
    """A nominal parameter of the drive and how well it is known.

    Attributes:
        value: of the parameter.
        tolerance: largest relative deviation within the expected, 5 % if it is not
            given; for a value of zero in its own unit, and none if it is not given: a
            twentieth of a second is no delay that nobody mentioned.
        free: whether nothing is known of it: a fit may choose any value.
    """

    value: float
    tolerance: float = field(default=math.nan, metadata=_TOLERANCE)
    free: bool = False

    def __post_init__(self) -> None:
        """Puts the tolerance of what was not given."""
        if math.isnan(self.tolerance):
            object.__setattr__(self, "tolerance", 0.05 if self.value else 0.0)


@dataclass(frozen=True)
class Masses:
    """How well the masses of the MJCF file are known; their values stand there.

    Attributes:
        tolerance: largest relative deviation within the expected, of the masses and
            inertias that a joint moves, of its rotor and of the carrying body.
    """

    tolerance: float = field(default=0.05, metadata=_TOLERANCE)


@dataclass(frozen=True)
class Cascade:
    """A position loop around a velocity loop (P-PI), by the gains of such a drive.

        v_ref = clip(k_pos (target − angle), ± speed_limit)
        τ = k_vel (v_ref − speed) + k_int ∫ (v_ref − speed) dt

    Without integral and limit that is a servo with kp = k_pos k_vel and kd = k_vel.

    Attributes:
        k_pos: gain of the position loop [1/s], more than 0.
        k_vel: gain of the velocity loop [N·m·s/rad, or N·s/m], more than 0.
        k_int: its integral gain [N·m/rad, or N/m], at least 0; 0: no integral.
        speed_limit: largest |v_ref| [rad/s, or m/s], more than 0; inf: none.
    """

    k_pos: Nominal
    k_vel: Nominal
    k_int: Nominal = field(default_factory=lambda: Nominal(0.0))
    speed_limit: float = math.inf

    def __post_init__(self) -> None:
        for name in ("k_pos", "k_vel"):
            if not 0.0 < getattr(self, name).value < math.inf:
                found = getattr(self, name).value
                raise InputError("drive", f"{name}.value", found, "more than 0")
        integral = self.k_int
        if not 0.0 <= integral.value < math.inf:
            raise InputError("drive", "k_int.value", integral.value, "at least 0")
        if integral.free and not integral.value:
            valid = "more than 0, where a search may begin"
            raise InputError("drive", "k_int.value", integral.value, valid)
        if not self.speed_limit > 0.0:
            raise InputError("drive", "speed_limit", self.speed_limit, "more than 0")

    def gains(self) -> tuple[Nominal, Nominal]:
        """Gains of the law without integral: kp = k_pos k_vel, kd = k_vel.

        Returns:
            Position gain [N·m/rad], whose relative tolerance is √(t_pos² + t_vel²), and
            velocity gain [N·m·s/rad].

        Source:
            Textbook: errors of factors that are independent.
        """
        product = self.k_pos.value * self.k_vel.value
        tolerance = math.hypot(self.k_pos.tolerance, self.k_vel.tolerance)
        free = self.k_pos.free or self.k_vel.free
        return Nominal(product, tolerance, free), self.k_vel


_NOT_GIVEN = Nominal(math.nan)
"""A gain that is not in the file."""


@dataclass(frozen=True)
class JointDrive:
    """Drive of one joint as simulated so far.

    Attributes:
        kp: position gain [N·m/rad, or N/m], more than 0; with a cascade that of its
            `gains`.
        kd: velocity gain [N·m·s/rad, or N·s/m]; the same.
        kp_setting: name of a setting in the logs' headers that multiplies `kp`; "" if
            the gain is the same in all records.
        effort: column that holds the effort of the drive.
        effort_scale: N·m (or N) per unit of that column, more than 0.
        effects: effects that the simulation has, with their parameters by name.
        known: `controller` where unknown forces push on the joint, `mechanics` where
            the law of the controller is not known: only that part is examined then.
        masses: how well those that the joint moves are known.
        cascade: gains of a drive with a velocity loop, in the place of `kp` and `kd`.
    """

    kp: Nominal = _NOT_GIVEN
    kd: Nominal = _NOT_GIVEN
    kp_setting: str = ""
    effort: Effort = "tau"
    effort_scale: Nominal = field(default_factory=lambda: Nominal(1.0, 0.02))
    effects: dict[str, dict[str, Nominal]] = field(default_factory=dict)
    known: Part = "both"
    masses: Masses = field(default_factory=Masses)
    cascade: Cascade | None = None

    def __post_init__(self) -> None:
        self._take_cascade()
        for name, parameters in self.effects.items():
            _check_effect(name, parameters)
        for name in ("kp", "kd"):
            if getattr(self, name) is _NOT_GIVEN:
                valid = "a mapping of value, tolerance, free; or `cascade`"
                raise InputError("drive", name, "", valid)
            if not getattr(self, name).value >= 0.0:
                raise InputError("drive", name, getattr(self, name).value, "at least 0")
        if not self.kp.value:
            valid = "more than 0; any, where `known: mechanics` leaves it unexamined"
            raise InputError("drive", "kp", self.kp.value, valid)
        if not 0.0 < self.effort_scale.value < math.inf:
            valid = "more than 0: an effort in the direction of the angle"
            raise InputError("drive", "effort_scale", self.effort_scale.value, valid)

    def _take_cascade(self) -> None:
        """Takes the gains of the cascade; others beside them are refused."""
        if self.cascade is None:
            return
        for name, gain in zip(("kp", "kd"), self.cascade.gains(), strict=True):
            given = getattr(self, name)
            if given is not _NOT_GIVEN and given != gain:
                valid = "nothing beside `cascade`: kp is k_pos k_vel, and kd k_vel"
                raise InputError("drive", name, given.value, valid)
            object.__setattr__(self, name, gain)

    def parameter(self, effect: str, name: str, absent: float) -> float:
        """Returns a parameter of an effect that the simulation has, else `absent`."""
        found = self.effects.get(effect, {}).get(name)
        return absent if found is None else found.value


def _check_effect(effect: str, parameters: dict[str, Nominal]) -> None:
    """Refuses effects and parameters that a joint cannot have."""
    kind = effect_kind(effect)
    if not kind.acts or effect in NEVER_NOMINAL:
        valid = "effects on one joint: this one is not simulated there"
        raise InputError("drive", "effects", effect, valid)
    for name, given in parameters.items():
        if name not in kind.parameters:
            valid = one_of(kind.parameters, name)
            raise InputError("drive", f"effects.{effect}", name, valid)
        _check_range(effect, name, given.value)


def _check_range(effect: str, name: str, value: float) -> None:
    """Refuses what no robot has: bounds that know of sizes hold for the hand alone."""
    parameter = effect_kind(effect).parameters[name]
    low, high = parameter.low, parameter.high
    if parameter.unit not in UNIVERSAL:
        low, high = (0.0 if low >= 0.0 else -np.inf), np.inf
    if parameter.identity == np.inf and value == 0.0:
        valid = f"more than 0 {parameter.unit}: nothing would move within this limit"
        raise InputError("drive", f"effects.{effect}.{name}", value, valid)
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
