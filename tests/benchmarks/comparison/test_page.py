"""The page's table is the one of the committed rows."""

import pytest

from benchmarks.comparison.page import PAGE, ROOT, with_table
from benchmarks.comparison.rows import read_rows

ROWS = read_rows(ROOT / "benchmarks/results/comparison-cpu.jsonl")


def test_the_table_is_made_of_the_committed_rows():
    text = PAGE.read_text("utf-8")
    assert ROWS
    assert with_table(text, ROWS) == text
    assert with_table(text, ROWS[1:]) != text


def test_every_figure_has_version_command_and_commit():
    figures = [row for row in ROWS if row.value is not None]
    assert all(row.version and row.command and row.commit for row in figures)


def test_a_page_without_marks_is_not_rewritten():
    with pytest.raises(ValueError, match="marks"):
        with_table("no marks", ROWS)
