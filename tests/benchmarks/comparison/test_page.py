"""The page's tables are those of the committed rows."""

import pytest

from benchmarks.comparison.page import (
    NO_ROWS,
    PAGE,
    STARTS,
    committed,
    part,
    with_tables,
)
from benchmarks.comparison.rows import Row

ROWS = committed()
MARKS = "".join(
    f"<!-- {name} rows: {x} -->\n" for name in ROWS for x in ("begin", "end")
)
RATE = "control steps per second of all worlds together"


def rate(peer, worlds, value, quantity=RATE, unit="steps/s"):
    note = "same hand" if value else "not measured: no answer in 120 s"
    return Row(f"speed-{worlds}", peer, "1.0", quantity, unit, value, note=note)


def test_the_tables_are_made_of_the_committed_rows():
    text = PAGE.read_text("utf-8")
    assert ROWS["cpu"]
    assert with_tables(text, ROWS) == text
    for device, rows in ROWS.items():
        fewer = rows[1:] if rows else [rate("ours", 512, 1.0)]
        assert with_tables(text, ROWS | {device: fewer}) != text


def test_every_figure_has_version_command_and_commit():
    every = [row for rows in ROWS.values() for row in rows]
    figures = [row for row in every if row.value is not None]
    assert all(row.version and row.command and row.commit for row in figures)


def test_rates_stand_side_by_side_over_the_worlds():
    rows = [
        rate("theirs", 2048, None),
        rate("ours", 2048, 1234567.8),
        rate("theirs", 512, 3000.0),
        rate("theirs", 512, 0.5, "rate of ours = 1", "ratio"),
    ]
    compact, _, long = part(rows).partition("\n\n")
    assert compact.split("\n") == [
        "| control steps per second | 512 worlds | 2,048 worlds |",
        "|---|---|---|",
        "| theirs | 3,000 | – |",
        "| ours | – | 1,234,568 |",
    ]
    assert long.count("\n") == 2 + len(rows)
    assert "| none | 1.0 | not measured: no answer in 120 s |" in long


def test_rates_of_one_number_of_worlds_are_not_repeated():
    assert part([rate("ours", 512, 1.0)]).startswith("| peer | quantity |")


@pytest.mark.parametrize(
    ("unit", "ends", "quantity", "said"),
    [
        ("1", (None, None), "largest difference", "0.25"),
        ("s", (0.25, 0.25), f"{STARTS} to its end", "0.25 s (one start)"),
        ("steps/s", (0.25, 0.25), RATE, "0.25 steps/s"),
        ("s", (0.2, 0.3), f"{STARTS} to its end", "0.25 s (0.2 to 0.3)"),
        ("s", (None, None), "time of the fit", "0.25 s"),
    ],
)
def test_a_figure_has_no_unit_of_one_and_no_interval_of_one_start(
    unit, ends, quantity, said
):
    row = Row("first", "ours", "1.0", quantity, unit, 0.25, *ends)
    assert f"| {quantity} (first) | {said} | 1.0 |" in part([row])


def test_a_device_without_rows_says_so():
    assert NO_ROWS in with_tables(MARKS, {"gpu": []})
    assert NO_ROWS not in with_tables(MARKS, {"gpu": [rate("ours", 512, 1.0)]})


def test_a_page_without_marks_is_not_rewritten():
    with pytest.raises(ValueError, match="marks"):
        with_tables("no marks", ROWS)
