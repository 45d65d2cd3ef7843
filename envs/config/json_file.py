"""JSON files of ours, read within limits: regular files, of some size and depth."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from envs.errors import InputError
from fingers_deploy.files import read_regular

MAX_JSON_BYTES = 1 << 24
MAX_JSON_DEPTH = 32


def read_json(path: Path, most: int = MAX_JSON_BYTES) -> Any:
    """Returns what a JSON file holds.

    Args:
        path: the file.
        most: its largest size [bytes].

    Raises:
        InputError: missing, no regular file, too large, not UTF-8, not JSON, or nested
            deeper than anything that we write.
    """
    return parse_json(read_regular(path, most), path)


def parse_json(text: str | bytes, source: object) -> Any:
    """Returns what JSON text holds.

    Raises:
        InputError: not UTF-8, not JSON, or nested too deep.
    """
    try:
        value = json.loads(text if isinstance(text, str) else text.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise InputError(source, "", error, "JSON") from error
    if (depth := _depth(value)) > MAX_JSON_DEPTH:
        valid = f"JSON of at most {MAX_JSON_DEPTH} levels"
        raise InputError(source, "", f"{depth} levels", valid)
    return value


def read_table(path: Path, most: int = MAX_JSON_BYTES) -> dict[str, Any]:
    """Returns the object that a JSON file holds.

    Raises:
        InputError: as `read_json`, or it holds something else.
    """
    value = read_json(path, most)
    if not isinstance(value, dict):
        raise InputError(path, "", type(value).__name__, "a JSON object")
    return value


def _depth(value: Any) -> int:
    """Levels of lists and objects; found without recursion."""
    level, inner = 0, [value]
    while inner := [x for x in inner if isinstance(x, list | Mapping)]:
        level += 1
        inner = [
            child
            for x in inner
            for child in (x.values() if isinstance(x, Mapping) else x)
        ]
    return level
