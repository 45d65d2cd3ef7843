"""Typed configuration: frozen dataclasses from and to dictionaries, YAML and the CLI.

Every mistake raises `InputError` naming the dotted field, what was found and what fits.
A field may carry metadata: `unit`, `low` and `high` (inclusive, for every number in
it), `doc`. YAML is read strictly: no duplicate keys, anchors, aliases, tags, deep
nesting or large files, and the scalars of YAML 1.2 (`1e-3` is a number, `on` is text).
"""

import contextlib
import dataclasses
import functools
import math
import re
import types
import typing
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import yaml

from envs.errors import InputError, one_of

T = TypeVar("T")
MAX_YAML_BYTES = 1 << 20
MAX_YAML_DEPTH = 32

_WORDS = {int: "a whole number", float: "a finite number", bool: "true or false"}
_RESOLVERS = (  # YAML 1.2 core schema: name, pattern, possible first characters
    ("null", r"~|null|", ["~", "n", ""]),
    ("bool", r"true|false", ["t", "f"]),
    ("int", r"[-+]?[0-9]+", list("-+0123456789")),
    (
        "float",
        r"[-+]?(\.[0-9]+|[0-9]+\.[0-9]*|[0-9]+(?=[eE]))([eE][-+]?[0-9]+)?"
        r"|[-+]?\.inf|\.nan",
        list("-+.0123456789"),
    ),
)


@dataclasses.dataclass(frozen=True)
class _Place:
    """Where a value stands and the range its field declares."""

    source: str
    field: str
    meta: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    def child(self, name: object, meta: Mapping[str, Any] | None = None) -> "_Place":
        """Returns the place of a value inside this one."""
        field = f"{self.field}.{name}" if self.field else str(name)
        return _Place(self.source, field, self.meta if meta is None else meta)

    def error(self, found: object, valid: str) -> InputError:
        """Returns the error for a value found here."""
        return InputError(self.source, self.field, found, valid)


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
    return _parse(cls, data, _Place(str(source), field))


def to_dict(obj: Any) -> Any:
    """Returns the plain data (dicts, lists, scalars) of a configuration."""
    if dataclasses.is_dataclass(obj):
        return {f.name: to_dict(getattr(obj, f.name)) for f in _init_fields(obj)}
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
    try:
        with open(path, "rb") as stream:
            content = stream.read(MAX_YAML_BYTES + 1)
        if len(content) > MAX_YAML_BYTES:
            raise ValueError(f"more than {MAX_YAML_BYTES} bytes")
        text = content.decode("utf-8")
    except (OSError, ValueError) as error:
        raise InputError(path, "", error, "a UTF-8 file of strict YAML") from error
    return from_dict(cls, _parse_yaml(text, path), path)


def dump_yaml(obj: Any) -> str:
    """Returns YAML text that `load_yaml` reads back to an equal configuration."""
    style = {"default_flow_style": None, "allow_unicode": True, "width": 88}
    return yaml.dump(to_dict(obj), Dumper=_Dumper, sort_keys=False, **style)


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
        _assign(data, field, _parse_yaml(text, f"{source} {field}"), source)
    return from_dict(type(obj), data, source)


def _assign(data: Any, field: str, value: object, source: str) -> None:
    """Puts `value` at a dotted path of nested dicts and lists."""
    names = field.split(".")
    for depth, name in enumerate(names):
        place, rest = _Place(source, ".".join(names[: depth + 1])), names[depth + 1 :]
        inner = range(len(data)) if isinstance(data, list) else data
        keys = {str(k): k for k in inner} if isinstance(data, dict | list) else {}
        if name not in keys and (rest or not isinstance(data, dict)):
            raise place.error(name, one_of(keys, name) if keys else "no subfield here")
        if not rest:
            data[keys.get(name, name)] = value
            return
        data = data[keys[name]]


def _parse(kind: Any, value: object, place: _Place) -> Any:
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


def _parse_dataclass(cls: Any, value: object, place: _Place) -> Any:
    fields = {f.name: f for f in _init_fields(cls)}
    if not isinstance(value, Mapping):
        raise place.error(value, f"a mapping of {', '.join(fields)}")
    for name in value:
        if name not in fields:
            raise place.child(name).error(name, one_of(fields, str(name)))
    kinds, built = _type_hints(cls), {}
    for name, field in fields.items():
        inner = place.child(name, field.metadata)
        if name in value:
            built[name] = _parse(kinds[name], value[name], inner)
        elif field.default is field.default_factory is dataclasses.MISSING:
            raise inner.error("", _describe(kinds[name], field.metadata))
    try:
        return cls(**built)
    except InputError as error:  # its field is relative to this dataclass
        inner = place.child(error.field) if error.field else place
        raise inner.error(error.found, error.valid) from error
    except ValueError as error:
        raise place.error(dict(value), str(error)) from error


def _parse_union(kind: Any, value: object, place: _Place) -> Any:
    options = typing.get_args(kind)
    if value is None and types.NoneType in options:
        return None
    fitting = [option for option in options if _has_shape(option, value)]
    for option in fitting[:-1]:
        with contextlib.suppress(InputError):
            return _parse(option, value, place)
    if not fitting:
        raise place.error(value, _describe(kind, place.meta))
    return _parse(fitting[-1], value, place)


def _has_shape(kind: Any, value: object) -> bool:
    """Returns whether `kind` is the sort of container (or scalar) that `value` is."""
    if dataclasses.is_dataclass(kind) or typing.get_origin(kind) is dict:
        return isinstance(value, Mapping)
    if typing.get_origin(kind) is tuple:
        return isinstance(value, list | tuple)
    return kind is not types.NoneType and not isinstance(value, Mapping | list | tuple)


def _parse_literal(valid: tuple[Any, ...], value: object, place: _Place) -> Any:
    for choice in valid:
        if type(choice) is type(value) and choice == value:
            return choice
    raise place.error(value, one_of(map(str, valid), str(value)))


def _parse_tuple(kind: Any, value: object, place: _Place) -> Any:
    kinds = typing.get_args(kind)
    if not isinstance(value, list | tuple):
        raise place.error(value, _describe(kind, place.meta))
    if kinds[-1] is Ellipsis:
        kinds = (kinds[0],) * len(value)
    if len(kinds) != len(value):
        raise place.error(f"{len(value)} values", _describe(kind, place.meta))
    pairs = enumerate(zip(kinds, value, strict=True))
    return tuple(_parse(inner, item, place.child(i)) for i, (inner, item) in pairs)


def _parse_dict(kind: Any, value: object, place: _Place) -> Any:
    if not isinstance(value, Mapping):
        raise place.error(value, f"a mapping of names to {_describe(kind, place.meta)}")
    return {
        _parse(str, name, place.child(name)): _parse(kind, item, place.child(name))
        for name, item in value.items()
    }


def _parse_scalar(kind: Any, value: Any, place: _Place) -> Any:
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
        return f"a mapping of {', '.join(f.name for f in _init_fields(kind))}"
    words = _WORDS.get(kind, "text" if kind is str else "null")
    return words + _describe_range(meta) if kind in (int, float) else words


def _describe_range(meta: Mapping[str, Any]) -> str:
    bounds = [f">= {meta['low']:g}"] if "low" in meta else []
    bounds += [f"<= {meta['high']:g}"] if "high" in meta else []
    bounds += [f"[{meta['unit']}]"] if meta.get("unit", "1") != "1" else []
    return " ".join(["", *bounds])


def _init_fields(cls: Any) -> list[dataclasses.Field[Any]]:
    return [field for field in dataclasses.fields(cls) if field.init]


@functools.cache
def _type_hints(cls: Any) -> dict[str, Any]:
    return typing.get_type_hints(cls)


class _Loader(yaml.SafeLoader):
    """Safe loader with the core schema and without duplicate keys."""

    yaml_implicit_resolvers: dict[str, Any] = {}


class _Dumper(yaml.SafeDumper):
    """Safe dumper that quotes exactly the text `_Loader` would not read as text."""

    yaml_implicit_resolvers: dict[str, Any] = {}

    def ignore_aliases(self, data: Any) -> bool:
        return True  # equal objects are written twice


def _construct_mapping(loader: _Loader, node: yaml.MappingNode) -> dict[str, Any]:
    mapping: dict[str, Any] = {}
    for key_node, value_node in node.value:
        key = loader.construct_object(key_node, deep=True)
        if not isinstance(key, str) or key in mapping:
            fault = "twice" if isinstance(key, str) else "which is not text"
            raise _yaml_error(f"the key {key!r} {fault}", key_node)
        mapping[key] = loader.construct_object(value_node, deep=True)
    return mapping


def _construct_int(loader: _Loader, node: yaml.ScalarNode) -> int:
    if len(node.value) > 100:
        raise _yaml_error("a number of more than 100 digits", node)
    return int(node.value)


for _name, _pattern, _first in _RESOLVERS:
    for _class in (_Loader, _Dumper):
        _regexp = re.compile(f"^(?:{_pattern})$")
        _class.add_implicit_resolver(f"tag:yaml.org,2002:{_name}", _regexp, _first)
_Loader.add_constructor("tag:yaml.org,2002:map", _construct_mapping)
_Loader.add_constructor("tag:yaml.org,2002:int", _construct_int)


def _parse_yaml(text: str, source: object) -> Any:
    """Returns the plain data in YAML text, or raises with line and column."""
    try:
        _refuse_features(text)
        return _Loader(text).get_single_data()
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f" at line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        problem = f"{getattr(error, 'problem', None) or error}{where}"
        raise InputError(source, "", problem, "strict YAML") from error


def _refuse_features(text: str) -> None:
    """Refuses anchors, aliases, tags and deep nesting before anything is built."""
    depth = 0
    for event in yaml.parse(text, Loader=_Loader):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_YAML_DEPTH:
            raise _yaml_error(f"nesting deeper than {MAX_YAML_DEPTH}", event)
        if getattr(event, "anchor", None):  # aliases have one too
            raise _yaml_error("an anchor or alias", event)
        if getattr(event, "tag", None) is not None:
            raise _yaml_error("a tag", event)


def _yaml_error(problem: str, at: Any) -> yaml.YAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=at.start_mark)
