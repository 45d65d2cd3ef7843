"""JSON that is read strictly: no repeated keys, no conversion, no odd characters."""

import json
import math
from typing import Any

from fingers_deploy.decode import Place, Rules, decode
from fingers_deploy.errors import BundleError

MAX_JSON_BYTES = 1 << 20
_MAX_TEXT = 200
_FLOAT32_MAX = 3.4028234663852886e38  # all arithmetic behind the manifest is float32


def load_json(text: str | bytes, source: object) -> Any:
    """Reads JSON without repeated keys.

    NaN and infinity, which Python reads, are refused by `from_json`, field by field.

    Args:
        text: the JSON.
        source: name of the file, for messages.

    Raises:
        BundleError: the text is not strict JSON, or too long to read it at all.
    """
    if len(text) > MAX_JSON_BYTES:
        found, valid = f"{len(text)} characters", f"at most {MAX_JSON_BYTES}"
        raise BundleError(source, "", found, valid)
    try:
        return json.loads(text, object_pairs_hook=_unique)
    except (ValueError, RecursionError) as error:
        raise BundleError(source, "", f"JSON error: {error}", "strict JSON") from error


def from_json(kind: Any, value: Any, source: object) -> Any:
    """Returns what `load_json` read as an instance of `kind`; every field is required.

    Raises:
        BundleError: the value does not have exactly this form.
    """
    return decode(kind, value, Place(source, "", _RULES))


def _scalar(kind: Any, value: Any, place: Place) -> Any:
    return {float: _number, int: _integer, str: _text}[kind](value, place)


def _number(value: Any, place: Place) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise place.error(_found(value), "a number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not abs(number) <= _FLOAT32_MAX:
        raise place.error(number, "a finite number that fits float32")
    return number


def _integer(value: Any, place: Place) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise place.error(_found(value), "an integer")
    if abs(value) >= 2**63:
        raise place.error("a huge integer", "an integer below 2^63")
    return value


def _text(value: Any, place: Place) -> str:
    if not isinstance(value, str):
        raise place.error(_found(value), "a text")
    if not (0 < len(value) <= _MAX_TEXT and value.isascii() and value.isprintable()):
        valid = f"1 to {_MAX_TEXT} printable ASCII characters"
        raise place.error(ascii(value), valid)
    return value


_RULES = Rules(_scalar, BundleError, complete=True, entry="[{}]")


def _found(value: Any) -> str:
    return f"{type(value).__name__} {value!a}"


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) != len(pairs):
        seen: set[str] = set()
        for name, _ in pairs:
            if name in seen:
                raise ValueError(f"key {name[:_MAX_TEXT]!a} is repeated")
            seen.add(name)
    return table
