"""Typed configuration: frozen dataclasses from and to dictionaries, YAML and the CLI.

Every mistake raises `InputError` naming the dotted field, what was found and what fits.
A field may carry metadata: `unit`, `low` and `high` (inclusive, for every number in
it), `doc`. YAML is read strictly, see `envs.config.strict_yaml`.
"""

import dataclasses
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from envs.config.strict_yaml import MAX_YAML_BYTES, parse_yaml, write_yaml
from envs.errors import InputError, one_of
from fingers_deploy.decode import Place, Rules, decode, describe, init_fields
from fingers_deploy.files import read_regular

T = TypeVar("T")


def limits(unit: str, low: float, high: float) -> dict[str, Any]:
    """Metadata of a field: its unit and the range of every number in it."""
    return {"unit": unit, "low": low, "high": high}


def from_dict(cls: type[T], data: object, source: object, field: str = "") -> T:
    """Builds a configuration from plain data, checking every type, name and range.

    Args:
        cls: frozen dataclass whose fields are bool, int, float, str, Literal, Optional,
            unions, tuples, dict[str, ...] or dataclasses.
        data: mapping of field names to values, as read from YAML or JSON.
        source: where `data` comes from, for error messages.
        field: dotted field of `data` inside `source`.

    Returns:
        The configuration; integers given for floats are converted.

    Raises:
        InputError: unknown or missing field, wrong type, non-finite number, value out
            of range, or a ValueError or InputError (relative) of a `__post_init__`.
    """
    return decode(cls, data, Place(str(source), field, _RULES))


def to_dict(obj: Any) -> Any:
    """Returns the plain data (dicts, lists, scalars) of a configuration."""
    if dataclasses.is_dataclass(obj):
        return {f.name: to_dict(getattr(obj, f.name)) for f in init_fields(obj)}
    if isinstance(obj, Mapping):
        return {key: to_dict(value) for key, value in obj.items()}
    if isinstance(obj, tuple):
        return [to_dict(value) for value in obj]
    return obj


def load_yaml(cls: type[T], path: str | Path) -> T:
    """Reads a configuration from a strict YAML (or JSON) file.

    Raises:
        InputError: as `from_dict`; unreadable, too large, not UTF-8, not strict YAML.
    """
    content = read_regular(path, MAX_YAML_BYTES)
    try:
        text = content.decode("utf-8")
    except ValueError as error:
        raise InputError(path, "", error, "a UTF-8 file of strict YAML") from error
    return from_dict(cls, parse_yaml(text, path), path)


def dump_yaml(obj: Any) -> str:
    """Returns YAML text that `load_yaml` reads back to an equal configuration."""
    return write_yaml(to_dict(obj))


def override(obj: T, assignments: Iterable[str], source: str = "--set") -> T:
    """Returns `obj` with `dotted.field=value` assignments applied in order.

    A value is read as YAML (`1e-3`, `true`, `[1, 2]`, `null`); an element of a tuple is
    addressed by its index.

    Raises:
        InputError: as `from_dict`, or an assignment without `=`.
    """
    data = to_dict(obj)
    for assignment in assignments:
        field, equals, text = assignment.partition("=")
        if not (field and equals):
            raise InputError(source, "", assignment, "field.subfield=value")
        try:
            value = parse_yaml(text, source)
        except InputError as error:
            raise InputError(source, field, error.found, error.valid) from error
        _assign(data, field, value, source)
    return from_dict(type(obj), data, source)


def _assign(data: Any, field: str, value: object, source: str) -> None:
    """Puts `value` at a dotted path of nested dicts and lists."""
    names = field.split(".")
    for depth, name in enumerate(names):
        rest = names[depth + 1 :]
        place = Place(source, ".".join(names[: depth + 1]), _RULES)
        inner = range(len(data)) if isinstance(data, list) else data
        keys = {str(k): k for k in inner} if isinstance(data, dict | list) else {}
        if name not in keys and (rest or not isinstance(data, dict)):
            raise place.error(name, one_of(keys, name) if keys else "no subfield here")
        if not rest:
            data[keys.get(name, name)] = value
            return
        data = data[keys[name]]


def _scalar(kind: Any, value: Any, place: Place) -> Any:
    """Accepts a whole number for a float, nothing else of another type."""
    valid, meta = describe(kind, place.meta), place.meta
    if kind is float and type(value) is int and abs(value) < 1e300:
        value = float(value)
    if type(value) is not kind:
        raise place.error("nothing" if value is None else repr(value), valid)
    if kind in (int, float):
        low, high = meta.get("low", -math.inf), meta.get("high", math.inf)
        if value in (math.inf, -math.inf) or not low <= value <= high:
            raise place.error(value, valid)
    return value


_RULES = Rules(_scalar, InputError)
