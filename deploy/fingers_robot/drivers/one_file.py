"""An MJCF that stands for itself: it names no other file and builds nothing endless.

MuJoCo follows absolute and upward paths, in many attributes and spellings, and repeats
what it is asked to repeat; so the text is parsed and judged before MuJoCo sees it.
"""

import math
from pathlib import Path
from xml.parsers import expat

from fingers_deploy.errors import InputError
from fingers_deploy.files import read_regular

MAX_XML_BYTES, MAX_MJB_BYTES = 8 * 2**20, 32 * 2**20
MAX_ELEMENTS, MAX_DEPTH, MAX_COPIES = 20_000, 100, 1000
_ENDLESS = ("nrow", "ncol", "width", "height", "nkey", "nuserdata", "nstack", "memory")
_LARGEST = 8192


def read_model(path: str | Path) -> bytes:
    """Reads a model, which for MuJoCo to read is MJCF (.xml) or compiled (.mjb).

    Raises:
        InputError: no regular file, too large, or as `check_one_file`.
    """
    path = Path(path)
    if path.suffix == ".mjb":
        return read_regular(path, MAX_MJB_BYTES)
    data = read_regular(path, MAX_XML_BYTES)
    check_one_file(data, path)
    return data


def check_one_file(data: bytes, path: Path) -> None:
    """Refuses XML that names other files, or that asks for more than a hand needs.

    Args:
        data: the file.
        path: its name, for messages.

    Raises:
        InputError: naming line and attribute.
    """
    parser = expat.ParserCreate("utf-8")
    open_elements: list[float] = [1.0]
    count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        place = f"line {parser.CurrentLineNumber} <{tag[:30]}>"
        if count > MAX_ELEMENTS or len(open_elements) > MAX_DEPTH:
            valid = f"at most {MAX_ELEMENTS} elements, {MAX_DEPTH} deep"
            raise InputError(path, place, "more", valid)
        open_elements.append(open_elements[-1] * _copies(attributes))
        if not open_elements[-1] <= MAX_COPIES:
            raise InputError(path, place, "more copies", f"at most {MAX_COPIES}")
        _check_attributes(path, place, tag, attributes)

    def end(_: str) -> None:
        open_elements.pop()

    def refuse(*_: object) -> None:
        raise InputError(path, "", "a document type declaration", "MJCF without one")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise InputError(path, "", error, "an MJCF, well-formed XML") from error


def _check_attributes(
    path: Path, place: str, tag: str, attributes: dict[str, str]
) -> None:
    for name, value in attributes.items():
        if name.startswith("file") or tag == "include":
            found = f"another file, {value}"
            raise InputError(path, f"{place} {name}", found, "a model in one file")
        if name in _ENDLESS and not _number(value) <= _LARGEST:
            raise InputError(path, f"{place} {name}", value, f"at most {_LARGEST}")


def _copies(attributes: dict[str, str]) -> float:
    counts = attributes.get("count", "").split()
    return math.prod(max(1.0, _number(number)) for number in counts)


def _number(text: str) -> float:
    """The number in a text; NaN, which no limit admits, if there is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan
