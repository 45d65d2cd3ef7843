"""The hand model file: everything in which two hands differ, with unit and source.

Read by training, identification, evaluation and export; the default `hand.yaml` beside
this module is the calibrated hand of the paper. Fields ending in `pos`, `offset` and
`size` are in the palm frame (dorsal side -x, fingers +z).
"""

import dataclasses
import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from envs.actuator.catalogue import CATALOGUE
from envs.config.atomic_file import write_atomic
from envs.config.typed import dump_yaml, load_yaml, to_dict
from envs.errors import InputError, one_of
from envs.hand.figures import Figures, figures
from envs.hand.places import fingers_at, joints_at

SCHEMA = 1
DEFAULT_HAND_FILE = Path(__file__).with_name("hand.yaml")
SOURCES = r"paper|vendor|ours|user|identified from \S.*"

EFFECTS: dict[str, dict[str, str]] = {n: k.units() for n, k in CATALOGUE.items()}
"""Units of the parameters of all effects, by effect and parameter name."""

_NOT_GIVEN = (("note", ""), ("other", ""))


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
    """A number for all joints, a list of 20 in joint order, or 20 by joint name."""

    value: float | tuple[float, ...] | dict[str, float]
    unit: str
    source: str
    low: float | tuple[float, ...] | dict[str, float] | None = None
    high: float | tuple[float, ...] | dict[str, float] | None = None
    note: str = ""

    def __post_init__(self) -> None:
        _check_quantity(self)

    def per_joint(self) -> Float[np.ndarray, "20"]:
        """Returns the values of the 20 joints, thumb to little, proximal first."""
        return np.broadcast_to(_numbers(self, "value"), 20).copy()


@dataclass(frozen=True)
class Effect:
    """What this hand does beside the figures above.

    Attributes:
        name: of an effect in `envs.actuator.catalogue`.
        parameters: all its parameters.
        where: places that have it: `all`, `flexion`, `abduction`, `pip`, `dip`, fingers
            or joints by name. Effects of fingertips take fingers, effects of the whole
            hand `all`.
        other: joint that a coupled joint follows; for `joint_coupling` only.
    """

    name: str
    parameters: dict[str, Quantity] = field(default_factory=dict)
    where: tuple[str, ...] = ("all",)
    other: str = ""


def _limits(unit: str, low: float, high: float) -> dict[str, Any]:
    return {"unit": unit, "low": low, "high": high}


@dataclass(frozen=True)
class HandFile:
    """One hand; the metadata of each field is its unit and the range it may take."""

    schema: int
    name: str
    palm_mass: Quantity = field(metadata=_limits("kg", 0.01, 5.0))
    palm_com_offset: Vector = field(metadata=_limits("m", -0.1, 0.1))
    payload_mass: Quantity = field(metadata=_limits("kg", 0.0, 2.0))
    payload_pos: Vector = field(metadata=_limits("m", -0.2, 0.2))
    payload_size: Vector = field(metadata=_limits("m", 0.001, 0.3))
    stiffness_scale: JointQuantity = field(metadata=_limits("1", 0.01, 1000.0))
    damping_scale: JointQuantity = field(metadata=_limits("1", 0.0, 1000.0))
    torque_scale: JointQuantity = field(metadata=_limits("1", 0.0, 10.0))
    speed_limit: JointQuantity = field(metadata=_limits("rad/s", 0.01, 100.0))
    delay_s: Quantity = field(metadata=_limits("s", 0.0, 0.2))
    lowpass_hz: Quantity = field(metadata=_limits("Hz", 0.05, 1000.0))
    tip_friction: Quantity = field(metadata=_limits("1", 0.0, 10.0))
    link_friction: Quantity = field(metadata=_limits("1", 0.0, 10.0))
    effects: tuple[Effect, ...] = ()
    figures: Figures | None = None

    def __post_init__(self) -> None:
        if self.schema != SCHEMA:
            raise InputError("hand file", "schema", self.schema, f"{SCHEMA}")
        for item in dataclasses.fields(self):
            if "unit" in item.metadata:
                _check_limits(item.name, getattr(self, item.name), item.metadata)
        for index, effect in enumerate(self.effects):
            _check_effect(f"effects.{index}", effect)
        _check_places(self.effects)

    @property
    def nominal(self) -> Figures:
        """What the scales multiply: figures of the file's own, else the vendor's."""
        return self.figures or figures()

    @property
    def without_effects(self) -> "HandFile":
        """The hand of the figures alone, which stance and starts are made for."""
        return dataclasses.replace(self, effects=())

    @property
    def sha256(self) -> str:
        """Digest of the contents; layout and comments of the file do not enter."""
        data = to_dict(self)
        if self.figures is None:  # as files without the field always were
            del data["figures"]
        text = json.dumps(data, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()


def load_hand_file(path: str | Path = DEFAULT_HAND_FILE) -> HandFile:
    """Reads a hand model file.

    Raises:
        InputError: not strict YAML; unknown or missing field; wrong type, unit or
            source; number outside its range or interval; wrong joint names or count;
            unknown effect; other schema.
    """
    return load_yaml(HandFile, path)


def hand_yaml(hand: HandFile) -> str:
    """Returns the contents of a hand model file that reads back to `hand`."""
    return dump_yaml(_without_empty(to_dict(hand)))


def save_hand_file(hand: HandFile, path: str | Path) -> None:
    """Writes a hand model file that `load_hand_file` reads back exactly.

    The file appears whole or not at all.
    """
    write_atomic(Path(path), hand_yaml(hand))


def _without_empty(data: Any) -> Any:
    """Leaves out intervals, notes and partners that are not given."""
    if isinstance(data, Mapping):
        given = {k: v for k, v in data.items() if v is not None}
        kept = {k: v for k, v in given.items() if (k, v) not in _NOT_GIVEN}
        return {key: _without_empty(value) for key, value in kept.items()}
    return [_without_empty(v) for v in data] if isinstance(data, list) else data


def _check_quantity(quantity: Quantity | Vector | JointQuantity) -> None:
    """Refuses an unknown source and a value outside its own interval."""
    if not re.fullmatch(SOURCES, quantity.source):
        valid = "paper, vendor, ours, user or 'identified from <log hash>'"
        raise InputError("hand file", "source", quantity.source, valid)
    value = _numbers(quantity, "value")
    for name, sign in (("low", 1), ("high", -1)):
        bound = getattr(quantity, name)
        if bound is not None and np.any(sign * (value - _numbers(quantity, name)) < 0):
            valid = f"a value inside the interval, whose {name} is {bound}"
            raise InputError("hand file", "value", quantity.value, valid)


def _check_limits(name: str, quantity: Any, meta: Mapping[str, Any]) -> None:
    """Refuses another unit than the field's and numbers outside its range."""
    if quantity.unit != meta["unit"]:
        raise InputError("hand file", f"{name}.unit", quantity.unit, meta["unit"])
    value = _numbers(quantity, "value")
    if np.any(value < meta["low"]) or np.any(value > meta["high"]):
        valid = f"{meta['low']:g} to {meta['high']:g} [{meta['unit']}]"
        raise InputError("hand file", f"{name}.value", quantity.value, valid)


def _check_effect(name: str, effect: Effect) -> None:
    """Refuses effects, parameters, units and places that the catalogue has not."""
    if effect.name not in EFFECTS:
        valid = one_of(EFFECTS, effect.name)
        raise InputError("hand file", f"{name}.name", effect.name, valid)
    units = EFFECTS[effect.name]
    found = {key: quantity.unit for key, quantity in effect.parameters.items()}
    if found != units:
        valid = "these parameters with these units: " + json.dumps(units)
        raise InputError("hand file", f"{name}.parameters", found, valid)
    for key, parameter in CATALOGUE[effect.name].parameters.items():
        limits = _limits(parameter.unit, parameter.low, parameter.high)
        _check_limits(f"{name}.parameters.{key}", effect.parameters[key], limits)
    _check_where(name, effect)


def _check_where(name: str, effect: Effect) -> None:
    """Refuses places that the effect cannot have, and a wrong or missing partner."""
    scope = CATALOGUE[effect.name].scope
    if scope == "hand" and effect.where != ("all",):
        valid = "[all], for an effect of the whole hand"
        raise InputError("hand file", f"{name}.where", list(effect.where), valid)
    at = fingers_at(effect.where) if scope == "finger" else joints_at(effect.where)
    if not at:
        raise InputError("hand file", f"{name}.where", "[]", "at least one place")
    if effect.name == "joint_coupling":
        if effect.other not in figures().joint_names:
            valid = one_of(figures().joint_names, effect.other)
            raise InputError("hand file", f"{name}.other", effect.other, valid)
        if joints_at((effect.other,))[0] in at:
            valid = "a joint that the effect does not act on"
            raise InputError("hand file", f"{name}.other", effect.other, valid)
    elif effect.other:
        valid = "nothing: only joint_coupling has another joint"
        raise InputError("hand file", f"{name}.other", effect.other, valid)


def _check_places(effects: tuple[Effect, ...]) -> None:
    """Refuses an effect that one place has twice."""
    taken: set[tuple[str, int]] = set()
    for index, effect in enumerate(effects):
        fingers = CATALOGUE[effect.name].scope == "finger"
        at = fingers_at(effect.where) if fingers else joints_at(effect.where)
        new = {(effect.name, place) for place in at}
        if taken & new:
            valid = f"places that have no {effect.name} by an entry before"
            found = list(effect.where)
            raise InputError("hand file", f"effects.{index}.where", found, valid)
        taken |= new


def _numbers(quantity: Any, name: str) -> np.ndarray:
    """Returns a value or bound as an array: scalar, 3, or 20 in joint order."""
    value = getattr(quantity, name)
    if isinstance(quantity, JointQuantity):
        value = _in_joint_order(value, name)
    return np.asarray(value, dtype=float)


def _in_joint_order(value: Any, name: str) -> Any:
    """Checks names and count of per-joint numbers; a single number passes."""
    joints = figures().joint_names
    if isinstance(value, Mapping):
        for joint in value:
            if joint not in joints:
                valid = one_of(joints, joint)
                raise InputError("hand file", f"{name}.{joint}", joint, valid)
        missing = [joint for joint in joints if joint not in value]
        if missing:
            valid = "all 20 joints, also " + ", ".join(missing)
            raise InputError("hand file", name, f"{len(value)} joints", valid)
        return [value[joint] for joint in joints]
    if isinstance(value, tuple) and len(value) != len(joints):
        valid = f"{len(joints)} numbers, one per joint"
        raise InputError("hand file", name, f"{len(value)} numbers", valid)
    return value
