"""Rows: read back, skipped when there, never without a figure or a reason."""

import math

import pytest

from benchmarks.comparison.rows import Row, add_rows, lacking, read_rows

ROW = Row("speed-64", "ours", "1", "rate", "steps/s", 3.0, device="CPU")


def test_rows_are_read_back_and_end_the_search(tmp_path):
    kept = tmp_path / "rows.jsonl"
    assert lacking(read_rows(kept), "speed-64", "CPU")
    add_rows(kept, [ROW])
    add_rows(kept, [Row("first", "peer", "", "time", "s", None, note="no CUDA")])
    assert read_rows(kept)[0] == ROW
    assert len(read_rows(kept)) == 2
    assert not lacking(read_rows(kept), "speed-64", "CPU")
    assert lacking(read_rows(kept), "speed-64", "H200")


def test_a_line_cut_off_is_left_out(tmp_path):
    kept = tmp_path / "rows.jsonl"
    add_rows(kept, [ROW])
    whole = kept.read_text("utf-8")
    kept.write_text(whole + whole[:20], "utf-8")
    add_rows(kept, [ROW])
    assert read_rows(kept) == [ROW, ROW]


@pytest.mark.parametrize("value", [None, math.nan, math.inf])
def test_a_row_has_a_figure_or_a_reason(value):
    with pytest.raises(ValueError):
        Row("speed-64", "ours", "1", "rate", "steps/s", value)
