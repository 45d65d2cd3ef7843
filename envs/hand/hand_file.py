"""The hand model file: everything in which two hands differ, with unit and source.

Read by training, identification, evaluation and export; the default `hand.yaml` beside
this module is the calibrated hand of the paper. Fields ending in `pos`, `offset` and
`size` are in the palm frame (dorsal side -x, fingers +z).
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from envs.config.atomic_file import write_atomic
from envs.config.typed import dump_yaml, limits, load_yaml, to_dict
from envs.errors import InputError, one_of
from envs.hand.nominal import NominalHand, vendor_hand
from envs.hand.places import fingers_at, joints_at
from envs.hand.quantity import JointQuantity, Quantity, Vector, check_interval, numbers

if TYPE_CHECKING:
    from envs.actuator.effect import EffectKind

SCHEMA = 1
DEFAULT_HAND_FILE = Path(__file__).with_name("hand.yaml")

_NOT_GIVEN = (("note", ""), ("other", ""))


@dataclass(frozen=True)
class Effect:
    """What the joints of this hand do beside the parameters above.

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


@dataclass(frozen=True)
class StanceStart:
    """Where the settling of a hand's own stance begins.

    Attributes:
        target_rad: joint targets to hold [rad].
        qpos: palm position [m] and orientation, w x y z, then joint angles [rad].
    """

    target_rad: tuple[float, ...] = field(metadata=limits("rad", -6.3, 6.3))
    qpos: tuple[float, ...] = field(metadata=limits("m, 1, rad", -6.3, 6.3))

    def check(self, joints: int) -> None:
        """Refuses numbers of another hand."""
        for name, count in (("target_rad", joints), ("qpos", 7 + joints)):
            found = len(getattr(self, name))
            if found != count:
                where, valid = f"stance.{name}", f"{count} numbers"
                raise InputError("hand file", where, f"{found} numbers", valid)


@dataclass(frozen=True)
class HandFile:
    """One hand; the metadata of each field is its unit and the range it may take."""

    schema: int
    name: str
    palm_mass: Quantity = field(metadata=limits("kg", 0.01, 5.0))
    palm_com_offset: Vector = field(metadata=limits("m", -0.1, 0.1))
    payload_mass: Quantity = field(metadata=limits("kg", 0.0, 2.0))
    payload_pos: Vector = field(metadata=limits("m", -0.2, 0.2))
    payload_size: Vector = field(metadata=limits("m", 0.001, 0.3))
    stiffness_scale: JointQuantity = field(metadata=limits("1", 0.01, 1000.0))
    damping_scale: JointQuantity = field(metadata=limits("1", 0.0, 1000.0))
    torque_scale: JointQuantity = field(metadata=limits("1", 0.001, 10.0))
    speed_limit: JointQuantity = field(metadata=limits("rad/s", 0.01, 100.0))
    delay_s: Quantity = field(metadata=limits("s", 0.0, 0.2))
    lowpass_hz: Quantity = field(metadata=limits("Hz", 0.05, 1000.0))
    tip_friction: Quantity = field(metadata=limits("1", 0.0, 10.0))
    link_friction: Quantity = field(metadata=limits("1", 0.0, 10.0))
    effects: tuple[Effect, ...] = ()
    description: NominalHand | None = None
    stance: StanceStart | None = None

    def __post_init__(self) -> None:
        if self.schema != SCHEMA:
            raise InputError("hand file", "schema", self.schema, f"{SCHEMA}")
        joints = self.nominal.joint_names
        for item in dataclasses.fields(self):
            if "unit" in item.metadata:
                quantity = getattr(self, item.name)
                _check_joints(item.name, quantity, joints)
                _check_limits(item.name, quantity, item.metadata, joints)
        for index, effect in enumerate(self.effects):
            _check_effect(f"effects.{index}", effect, self.nominal)
        _check_places(self.effects, self.nominal)
        if self.stance:
            self.stance.check(len(joints))

    @property
    def nominal(self) -> NominalHand:
        """Nominal parameters, which the scales multiply: its own, else the vendor's."""
        return self.description or vendor_hand()

    @property
    def without_effects(self) -> HandFile:
        """The hand without effects, which stance and starts are made for."""
        return dataclasses.replace(self, effects=())

    def per_joint(self, field: str) -> Float[np.ndarray, " joints"]:
        """A field's values x_j in joint order, as `per_joint("speed_limit")` [rad/s].

        Args:
            field: of those that are one number per joint, in the unit it states.

        Source:
            See `JointQuantity.per_joint`.
        """
        return getattr(self, field).per_joint(self.nominal.joint_names)

    @property
    def sha256(self) -> str:
        """Digest of the contents; layout and comments of the file do not enter."""
        data = to_dict(self)
        for name in ("description", "stance"):  # as files without them always were
            if getattr(self, name) is None:
                del data[name]
        text = json.dumps(data, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()


def load_hand_file(path: str | Path = DEFAULT_HAND_FILE) -> HandFile:
    """Reads a hand model file.

    Raises:
        InputError: not strict YAML; unknown or missing field; wrong type, unit or
            source; number outside its range or interval; wrong joint names or count;
            unknown effect; other schema.

    Examples:
        >>> hand = load_hand_file()
        >>> hand.nominal.fingers
        ('thumb', 'index', 'middle', 'ring', 'little')
        >>> hand.palm_mass.value, hand.palm_mass.unit, hand.palm_mass.source
        (0.38908, 'kg', 'paper')
        >>> hand.per_joint("speed_limit").shape
        (20,)
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


def _check_joints(name: str, quantity: Any, joints: tuple[str, ...]) -> None:
    """Refuses numbers of other joints, and values outside their own interval."""
    try:
        check_interval(quantity, joints)
    except InputError as error:
        where = f"{name}.{error.field}"
        raise InputError(error.source, where, error.found, error.valid) from error


def _check_limits(
    name: str, quantity: Any, meta: Mapping[str, Any], joints: tuple[str, ...] = ()
) -> None:
    """Refuses another unit than the field's and numbers outside its range."""
    if quantity.unit != meta["unit"]:
        raise InputError("hand file", f"{name}.unit", quantity.unit, meta["unit"])
    value = numbers(quantity, "value", joints)
    if np.any(value < meta["low"]) or np.any(value > meta["high"]):
        valid = f"{meta['low']:g} to {meta['high']:g} [{meta['unit']}]"
        raise InputError("hand file", f"{name}.value", quantity.value, valid)


def _check_effect(name: str, effect: Effect, hand: NominalHand) -> None:
    """Refuses effects, parameters, units and places that the catalogue has not."""
    kinds = _kinds()
    if effect.name not in kinds:
        valid = one_of(kinds, effect.name)
        raise InputError("hand file", f"{name}.name", effect.name, valid)
    kind = kinds[effect.name]
    units = kind.units()
    found = {key: quantity.unit for key, quantity in effect.parameters.items()}
    if found != units:
        valid = "these parameters with these units: " + json.dumps(units)
        raise InputError("hand file", f"{name}.parameters", found, valid)
    for key, parameter in kind.parameters.items():
        within = limits(parameter.unit, parameter.low, parameter.high)
        _check_limits(f"{name}.parameters.{key}", effect.parameters[key], within)
    _check_where(name, effect, kind.scope, hand)


def _check_where(name: str, effect: Effect, scope: str, hand: NominalHand) -> None:
    """Refuses places that the effect cannot have, and a wrong or missing partner."""
    if scope == "hand" and effect.where != ("all",):
        valid = "[all], for an effect of the whole hand"
        raise InputError("hand file", f"{name}.where", list(effect.where), valid)
    find = fingers_at if scope == "finger" else joints_at
    at = find(hand, effect.where)
    if not at:
        raise InputError("hand file", f"{name}.where", "[]", "at least one place")
    if effect.name == "joint_coupling":
        if effect.other not in hand.joint_names:
            valid = one_of(hand.joint_names, effect.other)
            raise InputError("hand file", f"{name}.other", effect.other, valid)
        if joints_at(hand, (effect.other,))[0] in at:
            valid = "a joint that the effect does not act on"
            raise InputError("hand file", f"{name}.other", effect.other, valid)
    elif effect.other:
        valid = "nothing: only joint_coupling has another joint"
        raise InputError("hand file", f"{name}.other", effect.other, valid)


def _check_places(effects: tuple[Effect, ...], hand: NominalHand) -> None:
    """Refuses an effect that one place has twice."""
    taken: set[tuple[str, int]] = set()
    for index, effect in enumerate(effects):
        fingers = _kinds()[effect.name].scope == "finger"
        find = fingers_at if fingers else joints_at
        new = {(effect.name, place) for place in find(hand, effect.where)}
        if taken & new:
            valid = f"places that have no {effect.name} by an entry before"
            found = list(effect.where)
            raise InputError("hand file", f"effects.{index}.where", found, valid)
        taken |= new


def _kinds() -> Mapping[str, EffectKind]:
    """Returns the catalogue; its equations load JAX, for which no other hand waits."""
    from envs.actuator.catalogue import CATALOGUE

    return CATALOGUE
