"""Checks an MJCF and the files it names before MuJoCo reads any of them.

MuJoCo follows absolute and `..` paths, replicates without limit and accepts NaN as a
time step; what this module lets through stays inside the model's own folder and has a
bounded size. Only text is looked at: nothing is compiled.
"""

import math
import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from envs.errors import InputError

MAX_XML_BYTES = 8 << 20
MAX_ASSET_BYTES = 256 << 20
MAX_XML_FILES = 64
MAX_ELEMENTS = 20_000
MAX_DEPTH = 100
MAX_COPIES = 1000
TIMESTEP_S = (1e-4, 0.02)

_ALLOCATIONS = ("nrow", "ncol", "width", "height", "nkey", "nuserdata", "nstack")
_MAX_ALLOCATION = 8192


@dataclass
class _Scan:
    """What has been read so far, over all XML files of a model."""

    root: Path
    source: str
    xml_files: set[Path] = field(default_factory=set)
    xml_bytes: int = 0
    assets: dict[Path, int] = field(default_factory=dict)
    asset_names: list[tuple[str, str]] = field(default_factory=list)
    folders: set[Path] = field(default_factory=set)
    elements: int = 0
    copies: list[int] = field(default_factory=lambda: [1])

    def error(self, where: str, found: object, valid: str) -> InputError:
        return InputError(self.source, where, found, valid)


def check_files(path: str | Path) -> Path:
    """Refuses an MJCF that is unsafe to hand to MuJoCo.

    Returns:
        The file with links followed, the path that was judged and may be loaded.

    Raises:
        InputError: not well-formed UTF-8 XML with root `mujoco`; a document type
            declaration; a file outside the model's folder, absent, not regular or too
            large; too many elements or copies; a number that is not finite; a time step
            outside `TIMESTEP_S`.
    """
    try:
        main = Path(path).resolve(strict=True)
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(path, "", error, "a readable MJCF file") from error
    scan = _Scan(main.parent, str(path))
    _scan_file(scan, main, "")
    for where, name in scan.asset_names:
        _check_asset(scan, where, name)
    return main


def _scan_file(scan: _Scan, path: Path, where: str) -> None:
    """Reads one XML file of the model and, through it, the files it includes."""
    if path in scan.xml_files:
        return
    scan.xml_files.add(path)
    scan.folders.add(path.parent)
    if len(scan.xml_files) > MAX_XML_FILES:
        raise scan.error(where, "more XML files", f"at most {MAX_XML_FILES}")
    text = _read(scan, path, where)
    parser = expat.ParserCreate()
    depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth == 1 and tag != "mujoco" and not (where and tag == "mujocoinclude"):
            raise scan.error(where, f"<{tag}>", "an MJCF file with root <mujoco>")
        place = f"{path.name}:{parser.CurrentLineNumber} <{tag}>"
        _check_element(scan, place, depth, attributes)
        _follow(scan, path.parent, place, tag, attributes)

    def end(_: str) -> None:
        nonlocal depth
        depth -= 1
        scan.copies.pop()

    def refuse(*_: object) -> None:
        raise scan.error(where, "a document type declaration", "MJCF without one")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise scan.error(where, error, "well-formed XML") from error


def _read(scan: _Scan, path: Path, where: str) -> str:
    if not os.path.isfile(path):
        raise scan.error(where, path.name, "a regular file in the model's folder")
    try:
        with open(path, "rb") as stream:
            content = stream.read(MAX_XML_BYTES + 1)
        text = content.decode("utf-8")
    except (OSError, ValueError) as error:
        raise scan.error(where, error, "readable UTF-8 XML") from error
    scan.xml_bytes += len(content)
    if scan.xml_bytes > MAX_XML_BYTES:
        raise scan.error(where, "more XML", f"at most {MAX_XML_BYTES} bytes in all")
    if re.search(r"<\?xml[^>]*encoding\s*=\s*['\"](?!utf-8)", text, re.IGNORECASE):
        raise scan.error(where, "another declared encoding", "UTF-8")
    return text


def _check_element(
    scan: _Scan, place: str, depth: int, attributes: dict[str, str]
) -> None:
    """Bounds the number, depth and multiplicity of elements and their sizes."""
    scan.elements += 1
    if scan.elements > MAX_ELEMENTS or depth > MAX_DEPTH:
        valid = f"at most {MAX_ELEMENTS} elements, {MAX_DEPTH} deep"
        raise scan.error(place, "more", valid)
    _check_finite(scan, place, attributes)
    counts = [_number(x) for x in attributes.get("count", "").split()]
    copies = scan.copies[-1] * math.prod(max(1.0, count) for count in counts)
    if not copies <= MAX_COPIES:
        raise scan.error(f"{place} count", attributes["count"], _copies_text())
    scan.copies.append(int(copies))
    for name in _ALLOCATIONS:
        if name in attributes and not _number(attributes[name]) <= _MAX_ALLOCATION:
            raise scan.error(
                f"{place} {name}", attributes[name], f"at most {_MAX_ALLOCATION}"
            )
    low, high = TIMESTEP_S
    if "timestep" in attributes and not low <= _number(attributes["timestep"]) <= high:
        valid = f"{low:g} to {high:g} s"
        raise scan.error(f"{place} timestep", attributes["timestep"], valid)


def _copies_text() -> str:
    return f"at most {MAX_COPIES} copies, nested ones multiplied"


def _number(text: str) -> float:
    """Returns the number in `text`, NaN (which no limit admits) if there is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def _check_finite(scan: _Scan, place: str, attributes: dict[str, str]) -> None:
    """Refuses NaN and infinity, which MuJoCo reads as "not given" or passes on."""
    for name, value in attributes.items():
        numbers = [_number(part) for part in value.split()]
        words = [part.lower().lstrip("+-") for part in value.split()]
        if math.inf in map(abs, numbers) or "nan" in words:
            raise scan.error(f"{place} {name}", value, "finite numbers")


def _follow(
    scan: _Scan, folder: Path, place: str, tag: str, attributes: dict[str, str]
) -> None:
    """Notes the folders and assets an element names and reads what it includes.

    A path may be meant relative to the main file or to the file it stands in: both must
    be safe.
    """
    bases = {scan.root, folder}
    for name, value in attributes.items():
        where = f"{place} {name}"
        if name.endswith("dir") and tag == "compiler":
            scan.folders |= {_inside(scan, where, base, value) for base in bases}
        elif name.startswith("file") and value:
            paths = sorted({_inside(scan, where, base, value) for base in bases})
            if tag not in ("include", "model"):
                scan.asset_names.append((where, value))
                continue
            for path in [path for path in paths if os.path.exists(path)] or paths:
                _scan_file(scan, path, where)


def _inside(scan: _Scan, where: str, folder: Path, value: str) -> Path:
    """Resolves a path that must stay in the model's folder, links followed."""
    bad = re.search(r"[\\:\0]|^[~/]", value)
    try:
        path = folder.joinpath(value).resolve()
    except (OSError, ValueError, RuntimeError) as error:
        raise scan.error(where, error, "a file in the model's folder") from error
    if bad or not path.is_relative_to(scan.root):
        raise scan.error(where, value, "a file in the model's folder")
    return path


def _check_asset(scan: _Scan, where: str, name: str) -> None:
    """Checks every place where MuJoCo may look for an asset; one must exist."""
    parts = {name, Path(name).name}  # `strippath` drops the folders of a name
    paths = {
        _inside(scan, where, base, part) for base in scan.folders for part in parts
    }
    there = [path for path in paths if os.path.exists(path)]
    if not there:
        raise scan.error(where, name, "a file that exists in the model's folder")
    if not all(map(os.path.isfile, there)):
        raise scan.error(where, name, "a regular file")
    scan.assets |= {path: path.stat().st_size for path in there}
    if sum(scan.assets.values()) > MAX_ASSET_BYTES:
        raise scan.error(where, "larger assets", f"at most {MAX_ASSET_BYTES} bytes")
