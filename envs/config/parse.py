"""Plain data to typed values, each mistake named by its place."""

import contextlib
import dataclasses
import functools
import math
import types
import typing
from collections.abc import Mapping
from typing import Any

from envs.errors import InputError, one_of

_WORDS = {int: "a whole number", float: "a finite number", bool: "true or false"}


@dataclasses.dataclass(frozen=True)
class Place:
    """Where a value stands and the range its field declares."""

    source: str
    field: str
    meta: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    def child(self, name: object, meta: Mapping[str, Any] | None = None) -> "Place":
        """Returns the place of a value inside this one."""
        field = f"{self.field}.{name}" if self.field else str(name)
        return Place(self.source, field, self.meta if meta is None else meta)

    def error(self, found: object, valid: str) -> InputError:
        """Returns the error for a value found here."""
        return InputError(self.source, self.field, found, valid)


def parse(kind: Any, value: object, place: Place) -> Any:
    """Converts `value` to type `kind` or raises the error of its place."""
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if dataclasses.is_dataclass(kind):
        return _parse_dataclass(kind, value, place)
    if origin in (typing.Union, types.UnionType):
        return _parse_union(kind, value, place)
    if origin is typing.Literal:
        return _parse_literal(args, value, place)
    if origin is tuple:
        return _parse_tuple(kind, value, place)
    if origin is dict:
        return _parse_dict(args[1], value, place)
    return _parse_scalar(kind, value, place)


def _parse_dataclass(cls: Any, value: object, place: Place) -> Any:
    fields = {f.name: f for f in init_fields(cls)}
    if not isinstance(value, Mapping):
        raise place.error(value, f"a mapping of {', '.join(fields)}")
    for name in value:
        if name not in fields:
            raise place.child(name).error(name, one_of(fields, str(name)))
    kinds, built = _type_hints(cls), {}
    for name, field in fields.items():
        inner = place.child(name, field.metadata)
        if name in value:
            built[name] = parse(kinds[name], value[name], inner)
        elif field.default is field.default_factory is dataclasses.MISSING:
            raise inner.error("", _describe(kinds[name], field.metadata))
    try:
        return cls(**built)
    except InputError as error:  # its field is relative to this dataclass
        inner = place.child(error.field) if error.field else place
        raise inner.error(error.found, error.valid) from error
    except ValueError as error:
        raise place.error(dict(value), str(error)) from error


def _parse_union(kind: Any, value: object, place: Place) -> Any:
    options = typing.get_args(kind)
    if value is None and types.NoneType in options:
        return None
    fitting = [option for option in options if _has_shape(option, value)]
    for option in fitting[:-1]:
        with contextlib.suppress(InputError):
            return parse(option, value, place)
    if not fitting:
        raise place.error(value, _describe(kind, place.meta))
    return parse(fitting[-1], value, place)


def _has_shape(kind: Any, value: object) -> bool:
    """Returns whether `kind` is the sort of container (or scalar) that `value` is."""
    if dataclasses.is_dataclass(kind) or typing.get_origin(kind) is dict:
        return isinstance(value, Mapping)
    if typing.get_origin(kind) is tuple:
        return isinstance(value, list | tuple)
    return kind is not types.NoneType and not isinstance(value, Mapping | list | tuple)


def _parse_literal(valid: tuple[Any, ...], value: object, place: Place) -> Any:
    for choice in valid:
        if type(choice) is type(value) and choice == value:
            return choice
    raise place.error(value, one_of(map(str, valid), str(value)))


def _parse_tuple(kind: Any, value: object, place: Place) -> Any:
    kinds = typing.get_args(kind)
    if not isinstance(value, list | tuple):
        raise place.error(value, _describe(kind, place.meta))
    if kinds[-1] is Ellipsis:
        kinds = (kinds[0],) * len(value)
    if len(kinds) != len(value):
        raise place.error(f"{len(value)} values", _describe(kind, place.meta))
    pairs = enumerate(zip(kinds, value, strict=True))
    return tuple(parse(inner, item, place.child(i)) for i, (inner, item) in pairs)


def _parse_dict(kind: Any, value: object, place: Place) -> Any:
    if not isinstance(value, Mapping):
        raise place.error(value, f"a mapping of names to {_describe(kind, place.meta)}")
    return {
        parse(str, name, place.child(name)): parse(kind, item, place.child(name))
        for name, item in value.items()
    }


def _parse_scalar(kind: Any, value: Any, place: Place) -> Any:
    valid, meta = _describe(kind, place.meta), place.meta
    if kind is float and type(value) is int and abs(value) < 1e300:
        value = float(value)
    if type(value) is not kind:
        raise place.error("nothing" if value is None else repr(value), valid)
    if kind in (int, float):
        low, high = meta.get("low", -math.inf), meta.get("high", math.inf)
        if value in (math.inf, -math.inf) or not low <= value <= high:
            raise place.error(value, valid)
    return value


def _describe(kind: Any, meta: Mapping[str, Any]) -> str:
    """Says in words what `kind` accepts."""
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Literal:
        return one_of(map(str, args))
    if origin in (typing.Union, types.UnionType):
        return " or ".join(_describe(option, meta) for option in args)
    if origin is tuple:
        count = "" if args[-1] is Ellipsis else f" of {len(args)}"
        return f"a list{count}, each {_describe(args[0], meta)}"
    if origin is dict:
        return f"a mapping of names to {_describe(args[1], meta)}"
    if dataclasses.is_dataclass(kind):
        return f"a mapping of {', '.join(f.name for f in init_fields(kind))}"
    words = _WORDS.get(kind, "text" if kind is str else "null")
    return words + _describe_range(meta) if kind in (int, float) else words


def _describe_range(meta: Mapping[str, Any]) -> str:
    bounds = [f">= {meta['low']:g}"] if "low" in meta else []
    bounds += [f"<= {meta['high']:g}"] if "high" in meta else []
    bounds += [f"[{meta['unit']}]"] if meta.get("unit", "1") != "1" else []
    return " ".join(["", *bounds])


def init_fields(cls: Any) -> list[dataclasses.Field[Any]]:
    """Returns the fields that a dataclass is made from."""
    return [field for field in dataclasses.fields(cls) if field.init]


@functools.cache
def _type_hints(cls: Any) -> dict[str, Any]:
    return typing.get_type_hints(cls)
