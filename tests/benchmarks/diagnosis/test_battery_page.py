"""The page about the battery says what its rows say."""

import dataclasses

import pytest

from benchmarks.diagnosis.battery_page import PAGE, ROWS, page
from benchmarks.diagnosis.score import Row, read_rows

PENDULUM = {"rig": "pendulum", "effort": "True"}
RIGHT = Row(
    group="single",
    effects=("deadband",),
    joint="a",
    magnitude="strong",
    ratio=4.0,
    kind="pendulum",
    seed=1,
    verdict="found",
    causes=("deadband",),
    errors={"deadband": 0.01},
    covered={"deadband": True},
    closed_loop=(2.0, 1.0),
    runtime_s=30.0,
    conditions=PENDULUM,
    evidence={"a": {"": -60.0, "deadband": 0.0}},
)
WRONG = dataclasses.replace(
    RIGHT, causes=("backlash",), evidence={"a": {"": -60.0, "backlash": 0.0}}
)
QUIET = Row(
    group="none",
    effects=(),
    joint="a",
    magnitude="faint",
    ratio=1.0,
    kind="pendulum",
    seed=2,
    verdict="none",
    conditions=PENDULUM,
    evidence={"a": {"": 0.0}},
)


def line(rows: list[Row], start: str) -> str:
    """The line of the page that begins so."""
    return next(x for x in page(rows).splitlines() if x.startswith(f"| {start}"))


def test_the_page_says_what_the_rows_say():
    assert PAGE.read_text("utf-8") == page(read_rows(ROWS))


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([RIGHT, RIGHT, QUIET], "2 of 2, 100.0 % | met |"),
        ([RIGHT, WRONG, QUIET], "1 of 2, 50.0 % | **missed** |"),
    ],
)
def test_an_aim_is_met_or_missed(rows, said):
    assert line(rows, "right cause first, strong").endswith(said)


def test_the_worst_level_of_a_factor_is_named():
    alarm = dataclasses.replace(QUIET, verdict="unexplained")
    found = line([RIGHT, QUIET, alarm], "false alarms in the worst level")
    assert "50.0 % (rig pendulum)" in found and "missed" in found


def test_a_loop_that_is_worse_is_missed():
    worse = dataclasses.replace(RIGHT, closed_loop=(1.0, 2.0))
    assert "missed" in line([worse, QUIET], "`found`, and worse")
    assert "met" in line([RIGHT, QUIET], "`found`, and worse")


def test_what_no_aim_counts_is_there_too():
    both = {"group": "double", "effects": ("deadband", "backlash")}
    half = dataclasses.replace(RIGHT, **both)
    whole = dataclasses.replace(half, causes=("deadband", "backlash"), runtime_s=90.0)
    rows = [RIGHT, QUIET, half, whole]
    assert line(rows, "both of two effects").endswith("1 of 2, 50.0 % |")
    assert line(rows, "an answer within 60 s").endswith("3 of 4, 75.0 % |")
    more = dataclasses.replace(RIGHT, causes=("deadband", "armature"))
    assert line([more, QUIET], "one effect, and no second").endswith("0 of 1, 0.0 % |")
    assert line([more, QUIET], "all causes and what").endswith("| 2 |")
