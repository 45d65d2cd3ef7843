"""The guides name every field that a log, its map and a drive may have."""

import re
from dataclasses import fields
from pathlib import Path

import pytest

from sysid.drive import Cascade, Nominal
from sysid.logs.bag import BagMap
from sysid.logs.columns import QUANTITIES, columns_of
from sysid.logs.log import Load, LogHeader

GUIDES = Path(__file__).parents[3] / "docs/guides"


def guide(name):
    return (GUIDES / name).read_text("utf-8")


def first_column(head):
    """Names in the first column of the table of the log's guide that begins so."""
    table = guide("logs.md").partition(f"| {head} |")[2].partition("\n\n")[0]
    cells = re.findall(r"^\| (`[^|]+) \|", table, re.MULTILINE)
    return [name for cell in cells for name in re.findall(r"`([^`]+)`", cell)]


@pytest.mark.parametrize(
    ("head", "documented"),
    [("field", LogHeader), ("field of `load`", Load), ("field of the map", BagMap)],
)
def test_every_field_has_a_row(head, documented):
    assert sorted(first_column(head)) == sorted(f.name for f in fields(documented))


def test_every_quantity_has_a_row_with_all_its_units():
    named = [name for name in first_column("column") if name not in ("t", "key")]
    assert sorted(re.split(r"\W", n)[0] for n in named) == sorted(QUANTITIES)
    rows = [r for r in guide("logs.md").splitlines() if r.startswith("| `")]
    for quantity, kind in QUANTITIES.items():
        row = next(r for r in rows if re.search(rf"`{quantity}\b", r))
        said = re.findall(r"[^ ,()]+", row.split("|")[2])
        assert set(kind.units) <= set(said), quantity


def test_every_part_of_a_quantity_is_named():
    for name in first_column("column"):
        quantity, _, parts = name.partition(".")
        if parts.startswith("{"):
            found = [f"{quantity}.{part}" for part in parts[1:-1].split(",")]
            assert found == list(columns_of(quantity, ()))


def test_every_part_of_a_figure_is_named():
    said = re.search(r"^Every figure is `\{([^}]+)\}`", guide("diagnose.md"), re.M)
    assert said is not None
    assert said[1].split(", ") == [f.name for f in fields(Nominal)]


def test_every_field_of_a_cascade_is_in_its_example():
    example = guide("diagnose.md").partition("    cascade:\n")[2].partition("```")[0]
    named = re.findall(r"^ {6}(\w+):", example, re.MULTILINE)
    assert named == [f.name for f in fields(Cascade)]
