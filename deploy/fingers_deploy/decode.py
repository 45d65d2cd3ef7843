"""Strict decoding of plain data into frozen dataclasses.

The type annotations are the schema. Nothing is guessed or ignored: an unknown or
missing name, another type or a number out of range is refused by a sentence that names
the field. What two formats differ in is their `Rules`.
"""

import contextlib
import dataclasses
import functools
import types
import typing
from collections.abc import Callable, Mapping
from typing import Any

from fingers_deploy.errors import one_of

_WORDS = {int: "a whole number", float: "a finite number", bool: "true or false"}


@dataclasses.dataclass(frozen=True)
class Rules:
    """What a format decides.

    Attributes:
        scalar: checks a bool, int, float or text of a kind at its place.
        error: class of the errors, made and read like `InputError`.
        complete: whether fields that have a default must be there too.
        entry: how an entry of a list is named.
    """

    scalar: Callable[[Any, Any, "Place"], Any]
    error: Any
    complete: bool = False
    entry: str = ".{}"


@dataclasses.dataclass(frozen=True)
class Place:
    """Where a value stands, by which rules, and the range that its field declares."""

    source: object
    field: str
    rules: Rules
    meta: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    def child(self, name: object, meta: Mapping[str, Any] | None = None) -> "Place":
        """Returns the place of a named value inside this one."""
        field = f"{self.field}.{_shown(name)}" if self.field else _shown(name)
        return self._at(field, self.meta if meta is None else meta)

    def entry(self, index: int) -> "Place":
        """Returns the place of an entry of the list here."""
        return self._at(self.field + self.rules.entry.format(index), self.meta)

    def error(self, found: object, valid: str) -> Exception:
        """Returns the error for a value found here."""
        return self.rules.error(self.source, self.field, found, valid)

    def _at(self, field: str, meta: Mapping[str, Any]) -> "Place":
        return Place(self.source, field, self.rules, meta)


def decode(kind: Any, value: object, place: Place) -> Any:
    """Returns `value` as an instance of the annotation `kind`.

    Args:
        kind: a scalar, Literal, union, tuple, dict[str, ...] or a dataclass of these.
        value: mappings, lists and scalars, as read from a file.
        place: where it stands.

    Raises:
        Rules.error: the value does not have this form.
    """
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if dataclasses.is_dataclass(kind):
        return _record(kind, value, place)
    if origin in (typing.Union, types.UnionType):
        return _union(kind, value, place)
    if origin is typing.Literal:
        return _literal(args, value, place)
    if origin is tuple:
        return _sequence(kind, value, place)
    if origin is dict:
        return _mapping(args[1], value, place)
    return place.rules.scalar(kind, value, place)


def _record(cls: Any, value: object, place: Place) -> Any:
    fields = {f.name: f for f in init_fields(cls)}
    if not isinstance(value, Mapping):
        raise place.error(value, f"a mapping of {', '.join(fields)}")
    for name in value:
        if name not in fields:
            valid = one_of(fields, str(name))
            raise place.child(name).error(_shown(name), valid)
    kinds, built = _type_hints(cls), {}
    for name, field in fields.items():
        inner = place.child(name, field.metadata)
        optional = not field.default is field.default_factory is dataclasses.MISSING
        if name in value:
            built[name] = decode(kinds[name], value[name], inner)
        elif place.rules.complete or not optional:
            raise inner.error("", describe(kinds[name], field.metadata))
    try:
        return cls(**built)
    except place.rules.error as error:  # its field is relative to this dataclass
        inner = place.child(error.field) if error.field else place
        raise inner.error(error.found, error.valid) from error
    except ValueError as error:
        raise place.error(dict(value), str(error)) from error


def _shown(name: object) -> str:
    return str(name) if str(name).isprintable() else ascii(name)


def _union(kind: Any, value: object, place: Place) -> Any:
    options = typing.get_args(kind)
    if value is None and types.NoneType in options:
        return None
    fitting = [option for option in options if _has_shape(option, value)]
    for option in fitting[:-1]:
        with contextlib.suppress(place.rules.error):
            return decode(option, value, place)
    if not fitting:
        raise place.error(value, describe(kind, place.meta))
    return decode(fitting[-1], value, place)


def _has_shape(kind: Any, value: object) -> bool:
    """Returns whether `kind` is the sort of container (or scalar) that `value` is."""
    if dataclasses.is_dataclass(kind) or typing.get_origin(kind) is dict:
        return isinstance(value, Mapping)
    if typing.get_origin(kind) is tuple:
        return isinstance(value, list | tuple)
    return kind is not types.NoneType and not isinstance(value, Mapping | list | tuple)


def _literal(valid: tuple[Any, ...], value: object, place: Place) -> Any:
    for choice in valid:
        if type(choice) is type(value) and choice == value:
            return choice
    raise place.error(value, one_of(map(str, valid), str(value)))


def _sequence(kind: Any, value: object, place: Place) -> tuple:
    kinds = typing.get_args(kind)
    if not isinstance(value, list | tuple):
        raise place.error(value, describe(kind, place.meta))
    if kinds[-1] is Ellipsis:
        kinds = (kinds[0],) * len(value)
    if len(kinds) != len(value):
        raise place.error(f"{len(value)} values", describe(kind, place.meta))
    pairs = enumerate(zip(kinds, value, strict=True))
    return tuple(decode(inner, item, place.entry(i)) for i, (inner, item) in pairs)


def _mapping(kind: Any, value: object, place: Place) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise place.error(value, f"a mapping of names to {describe(kind, place.meta)}")
    return {
        decode(str, name, place.child(name)): decode(kind, item, place.child(name))
        for name, item in value.items()
    }


def describe(kind: Any, meta: Mapping[str, Any]) -> str:
    """Says in words what `kind` accepts, within the range that `meta` declares."""
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Literal:
        return one_of(map(str, args))
    if origin in (typing.Union, types.UnionType):
        return " or ".join(describe(option, meta) for option in args)
    if origin is tuple:
        count = "" if args[-1] is Ellipsis else f" of {len(args)}"
        return f"a list{count}, each {describe(args[0], meta)}"
    if origin is dict:
        return f"a mapping of names to {describe(args[1], meta)}"
    if dataclasses.is_dataclass(kind):
        return f"a mapping of {', '.join(f.name for f in init_fields(kind))}"
    words = _WORDS.get(kind, "text" if kind is str else "null")
    return words + _describe_range(meta) if kind in (int, float) else words


def _describe_range(meta: Mapping[str, Any]) -> str:
    bounds = [f">= {meta['low']:.10g}"] if "low" in meta else []
    bounds += [f"<= {meta['high']:.10g}"] if "high" in meta else []
    bounds += [f"[{meta['unit']}]"] if meta.get("unit", "1") != "1" else []
    return " ".join(["", *bounds])


def init_fields(cls: Any) -> list[dataclasses.Field[Any]]:
    """Returns the fields that a dataclass is made from."""
    return [field for field in dataclasses.fields(cls) if field.init]


@functools.cache
def _type_hints(cls: Any) -> dict[str, Any]:
    return typing.get_type_hints(cls)
