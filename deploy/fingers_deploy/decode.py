"""Strict decoding of JSON into frozen dataclasses.

The type annotations are the schema. Nothing is converted, defaulted or ignored: an
unknown, missing or repeated key, another type or a non-finite number is refused by a
sentence that names the field.
"""

import dataclasses
import difflib
import json
import math
import types
import typing
from collections.abc import Iterable
from typing import Any

from fingers_deploy.errors import BundleError

_MAX_TEXT = 200
_FLOAT32_MAX = 3.4028234663852886e38  # all arithmetic behind the manifest is float32


def load_json(text: str | bytes, source: object) -> Any:
    """Reads JSON without repeated keys.

    NaN and infinity, which Python reads, are refused by `decode`, field by field.

    Args:
        text: the JSON.
        source: name of the file, for messages.

    Raises:
        BundleError: the text is not strict JSON.
    """
    try:
        return json.loads(text, object_pairs_hook=_unique)
    except (ValueError, RecursionError) as error:
        raise BundleError(source, "", f"JSON error: {error}", "strict JSON") from error


def decode(kind: Any, value: Any, source: object, path: str) -> Any:
    """Returns `value` as an instance of the annotation `kind`.

    Args:
        kind: str, int, float, a dataclass of such fields, a tuple, a dict with str
            keys, or a choice of a tuple, another one of these, and None.
        value: what `load_json` returned.
        source: name of the file, for messages.
        path: the field inside the file, for messages.

    Raises:
        BundleError: the value does not have exactly this form.
    """
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if dataclasses.is_dataclass(kind):
        return _record(typing.cast(type, kind), value, source, path)
    if origin is types.UnionType:
        return _choice(args, value, source, path)
    if origin is tuple:
        return _sequence(args, value, source, path)
    if origin is dict:
        return _mapping(args[1], value, source, path)
    return _SCALARS[kind](value, source, path)


def nearest(names: Iterable[str], found: str) -> str:
    """Lists the valid names, and the one that `found` was probably meant to be."""
    listed = list(names)
    near = difflib.get_close_matches(found, listed, n=1)
    hint = f" (did you mean {near[0]}?)" if near else ""
    return "one of " + ", ".join(listed) + hint


def _choice(kinds: tuple[Any, ...], value: Any, source: object, path: str) -> Any:
    """Decodes a list as the tuple among the kinds, anything else as the other one."""
    if value is None:
        return None
    listed = [kind for kind in kinds if typing.get_origin(kind) is tuple]
    others = [kind for kind in kinds if kind not in (*listed, types.NoneType)]
    chosen = listed if listed and isinstance(value, list) else others or listed
    return decode(chosen[0], value, source, path)


def _record(cls: type, value: Any, source: object, path: str) -> Any:
    hints = typing.get_type_hints(cls)
    table = _object(value, source, path)
    for name in table:
        if name not in hints:
            where = _join(path, name)
            raise BundleError(source, where, "an unknown key", nearest(hints, name))
    for name in hints:
        if name not in table:
            raise BundleError(source, _join(path, name), "no such key", "a value")
    return cls(
        **{n: decode(k, table[n], source, _join(path, n)) for n, k in hints.items()}
    )


def _sequence(args: tuple[Any, ...], value: Any, source: object, path: str) -> tuple:
    if not isinstance(value, list):
        raise BundleError(source, path, _kind(value), "a list")
    if args[-1] is not ... and len(value) != len(args):
        raise BundleError(source, path, f"{len(value)} entries", f"{len(args)} entries")
    return tuple(
        decode(args[0], v, source, f"{path}[{i}]") for i, v in enumerate(value)
    )


def _mapping(kind: Any, value: Any, source: object, path: str) -> dict[str, Any]:
    table = _object(value, source, path)
    return {
        _text(name, source, path): decode(kind, v, source, _join(path, name))
        for name, v in table.items()
    }


def _object(value: Any, source: object, path: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise BundleError(source, path, _kind(value), "a JSON object")
    return value


def _number(value: Any, source: object, path: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise BundleError(source, path, _kind(value), "a number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not abs(number) <= _FLOAT32_MAX:
        raise BundleError(source, path, number, "a finite number that fits float32")
    return number


def _integer(value: Any, source: object, path: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise BundleError(source, path, _kind(value), "an integer")
    if abs(value) >= 2**63:
        raise BundleError(source, path, "a huge integer", "an integer below 2^63")
    return value


def _text(value: Any, source: object, path: str) -> str:
    if not isinstance(value, str):
        raise BundleError(source, path, _kind(value), "a text")
    if not (0 < len(value) <= _MAX_TEXT and value.isascii() and value.isprintable()):
        valid = f"1 to {_MAX_TEXT} printable ASCII characters"
        raise BundleError(source, path, ascii(value), valid)
    return value


_SCALARS = {float: _number, int: _integer, str: _text}


def _kind(value: Any) -> str:
    return f"{type(value).__name__} {value!a}"


def _join(path: str, name: str) -> str:
    shown = name if name.isascii() and name.isprintable() else ascii(name)
    return f"{path}.{shown}" if path else shown


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) != len(pairs):
        names = [name for name, _ in pairs]
        repeated = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"key {repeated!a} is repeated")
    return table
