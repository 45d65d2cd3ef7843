"""Numbers of a hand file: each with its unit, its source and how certain it is."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from envs.errors import InputError, one_of

SOURCES = r"paper|vendor|ours|user|identified from \S.*"


@dataclass(frozen=True)
class Quantity:
    """A number with its provenance.

    Attributes:
        value: the number.
        unit: its unit, which must be the one of the field; "1" if it has none.
        source: `paper`, `vendor`, `ours`, `user` or `identified from <log hash>`.
        low, high: interval in which the source places the value, when it gives one.
        note: how it was found or chosen.
    """

    value: float
    unit: str
    source: str
    low: float | None = None
    high: float | None = None
    note: str = ""

    def __post_init__(self) -> None:
        _check_quantity(self)


@dataclass(frozen=True)
class Vector:
    """A position, offset or size with its provenance, as `Quantity`."""

    value: tuple[float, float, float]
    unit: str
    source: str
    low: tuple[float, float, float] | None = None
    high: tuple[float, float, float] | None = None
    note: str = ""

    def __post_init__(self) -> None:
        _check_quantity(self)


@dataclass(frozen=True)
class JointQuantity:
    """A number for all joints, a list of them in joint order, or all by joint name."""

    value: float | tuple[float, ...] | dict[str, float]
    unit: str
    source: str
    low: float | tuple[float, ...] | dict[str, float] | None = None
    high: float | tuple[float, ...] | dict[str, float] | None = None
    note: str = ""

    def __post_init__(self) -> None:
        _check_source(self)  # the rest when its hand is known

    def per_joint(self, joints: tuple[str, ...]) -> Float[np.ndarray, " joints"]:
        """The values x_j, j = 1 … n·m, thumb first, proximal first [1, rad/s].

        A single number holds for all joints: x_j = x.

        Args:
            joints: names of the hand's joints, in order.

        Source:
            Ours: one order of joints everywhere, that of the vendor's description.
        """
        return np.broadcast_to(numbers(self, "value", joints), len(joints)).copy()


def _check_source(quantity: Quantity | Vector | JointQuantity) -> None:
    """Refuses an unknown source."""
    if not re.fullmatch(SOURCES, quantity.source):
        valid = "paper, vendor, ours, user or 'identified from <log hash>'"
        raise InputError("hand file", "source", quantity.source, valid)


def _check_quantity(quantity: Quantity | Vector) -> None:
    _check_source(quantity)
    check_interval(quantity)


def check_interval(
    quantity: Quantity | Vector | JointQuantity, joints: tuple[str, ...] = ()
) -> None:
    """Refuses a value outside its own interval, or not of these joints."""
    value = numbers(quantity, "value", joints)
    for name, sign in (("low", 1), ("high", -1)):
        bound = getattr(quantity, name)
        if bound is None:
            continue
        if np.any(sign * (value - numbers(quantity, name, joints)) < 0):
            valid = f"a value inside the interval, whose {name} is {bound}"
            raise InputError("hand file", "value", quantity.value, valid)


def numbers(
    quantity: Any, name: str, joints: tuple[str, ...] = ()
) -> Float[np.ndarray, "..."]:
    """A value or bound as an array x of shape (), (3) or (joints) in joint order.

    Args:
        quantity: a `Quantity`, `Vector` or `JointQuantity`; x = its number or numbers,
            in the unit it states [kg, m, s, 1, …].
        name: `value`, `low` or `high`.
        joints: names of the hand's joints, for a `JointQuantity`.

    Source:
        Ours: files may name joints, arrays may not.
    """
    value = getattr(quantity, name)
    if isinstance(quantity, JointQuantity):
        value = _in_joint_order(value, name, joints)
    return np.asarray(value, dtype=float)


def _in_joint_order(value: Any, name: str, joints: tuple[str, ...]) -> Any:
    """Checks names and count of per-joint numbers; a single number passes."""
    if isinstance(value, Mapping):
        for joint in value:
            if joint not in joints:
                valid = one_of(joints, joint)
                raise InputError("hand file", f"{name}.{joint}", joint, valid)
        missing = [joint for joint in joints if joint not in value]
        if missing:
            valid = f"all {len(joints)} joints, also " + ", ".join(missing)
            raise InputError("hand file", name, f"{len(value)} joints", valid)
        return [value[joint] for joint in joints]
    if isinstance(value, tuple) and len(value) != len(joints):
        valid = f"{len(joints)} numbers, one per joint"
        raise InputError("hand file", name, f"{len(value)} numbers", valid)
    return value
