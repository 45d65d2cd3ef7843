"""The page of the gallery's later answers is what their rows say."""

import copy

import pytest

from benchmarks.diagnosis.gallery.__main__ import RECORDS
from benchmarks.diagnosis.gallery.again import AGAIN, FIRST, PAGE, again
from benchmarks.diagnosis.gallery.page import read_rows


@pytest.fixture
def rows():
    return read_rows(FIRST), read_rows(AGAIN)


def test_the_page_says_what_the_rows_say(rows):
    assert PAGE.read_text("utf-8") == again(RECORDS, *rows)
    assert {row["record"] for row in rows[1]} <= set(RECORDS)


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize(
    "change", [{"verdict": "none"}, {"causes": []}, {"right": False}]
)
def test_another_answer_is_another_page(rows, which, change):
    """Negative control, of each thing that the table shows."""
    before = again(RECORDS, *rows)
    changed = copy.deepcopy(rows)
    row = next(x for x in changed[which] if x["record"] == "tx40_friction")
    row.update(change)
    assert again(RECORDS, *changed) != before
