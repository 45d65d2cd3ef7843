"""One self-contained HTML page: tables, figures, video, notes and provenance."""

import base64
import io
import math
import platform
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import ClassVar, Literal

import jinja2
from matplotlib.figure import Figure

from envs.config.atomic_file import write_atomic
from envs.errors import InputError

TEMPLATE = Path(__file__).with_name("report.html")
PACKAGES = ("fingers-mjx", "jax", "mujoco", "mujoco-mjx", "brax", "numpy", "onnx")
MEDIA_TYPES = {
    ".mp4": "video/mp4",
    ".png": "image/png",
    ".webp": "image/webp",
    ".gif": "image/gif",
}
Cell = str | int | float | None


@dataclass(frozen=True)
class Note:
    """A paragraph of plain text; line breaks are kept."""

    text: str
    kind: ClassVar[str] = "note"


@dataclass(frozen=True)
class Commands:
    """Lines to type in a terminal."""

    lines: Sequence[str]
    kind: ClassVar[str] = "commands"


@dataclass(frozen=True)
class Table:
    """Rows of text and numbers; numbers are shown with four digits, NaN as a dash."""

    header: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""
    kind: ClassVar[str] = "table"


@dataclass(frozen=True)
class Picture:
    """A picture or video as a `data:` address; make it with `picture` or `video`."""

    uri: str
    caption: str = ""
    kind: Literal["picture", "video"] = "picture"


Block = Note | Commands | Table | Picture


@dataclass(frozen=True)
class Section:
    """A heading with blocks under it."""

    title: str
    blocks: Sequence[Block]


def write_report(
    path: Path, sections: Sequence[Section], title: str = "Report"
) -> Path:
    """Writes the page; all text is escaped, nothing is loaded from elsewhere.

    Args:
        path: HTML file to write, replaced as a whole.
        sections: in the order of the page.
        title: of the page.
    """
    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["shown"] = shown
    environment.tests["number"] = is_number
    template = environment.from_string(TEMPLATE.read_text(encoding="utf-8"))
    return write_atomic(path, template.render(title=title, sections=sections))


def picture(source: Figure | Path, caption: str = "") -> Picture:
    """Returns a figure, or a PNG, WebP or GIF file, ready to be put into a page.

    Raises:
        InputError: the file is missing or of another kind.
    """
    if isinstance(source, Path):
        return Picture(_data_uri(source, "image/"), caption)
    memory = io.BytesIO()
    source.savefig(memory, format="png", dpi=150)
    return Picture(_encoded(memory.getvalue(), "image/png"), caption)


def video(path: Path, caption: str = "") -> Picture:
    """Returns an mp4 file ready to be put into a page.

    Raises:
        InputError: the file is missing or of another kind.
    """
    return Picture(_data_uri(path, "video/"), caption, "video")


def measures_table(document: Mapping, caption: str = "") -> Table:
    """Returns the measures of an evaluation's JSON summary as a table."""
    keys = ("mean", "std", "low", "high", "n")
    rows = [
        (name, *(measure[key] for key in keys))
        for name, measure in document["measures"].items()
    ]
    header = ("measure", "mean", "std", "95 % low", "95 % high", "episodes")
    return Table(header, rows, caption)


def provenance(commands: Sequence[str] = (), commit: str | None = None) -> Section:
    """Returns the section that says where the page comes from.

    Args:
        commands: which made the results.
        commit: version of the code; asked from git if not given.
    """
    rows: list[tuple[str, str]] = [("commit", commit or commit_here() or "unknown")]
    rows += [(name, _version(name)) for name in PACKAGES]
    rows += [("Python", platform.python_version()), ("platform", platform.platform())]
    blocks: list[Block] = [Table(("what", "version"), rows)]
    return Section("Provenance", [Commands(commands), *blocks] if commands else blocks)


def commit_here() -> str | None:
    """Returns the commit of the source tree, "+changes" if dirty; None without git."""
    command = ["git", "describe", "--always", "--abbrev=12", "--exclude=*", "--dirty"]
    try:
        found = subprocess.run(
            command,
            cwd=TEMPLATE.parent,
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return found.stdout.strip().replace("-dirty", "+changes")


def shown(cell: Cell) -> str:
    """Returns a table cell as text: numbers with four digits, undefined as a dash."""
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return "–"
    return f"{cell:.4g}" if isinstance(cell, float) else str(cell)


def is_number(cell: Cell) -> bool:
    """Whether a cell is set to the right."""
    return cell is None or isinstance(cell, int | float)


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _data_uri(path: Path, family: str) -> str:
    media = MEDIA_TYPES.get(path.suffix, "")
    if not media.startswith(family):
        valid = [s for s, m in MEDIA_TYPES.items() if m.startswith(family)]
        raise InputError(path, "suffix", path.suffix, "one of " + ", ".join(valid))
    if not path.is_file():
        raise InputError(path, "", "no such file", f"an existing {path.suffix} file")
    return _encoded(path.read_bytes(), media)


def _encoded(content: bytes, media: str) -> str:
    return f"data:{media};base64,{base64.b64encode(content).decode('ascii')}"
