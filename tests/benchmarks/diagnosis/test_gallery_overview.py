"""The pages of the gallery are what its rows say."""

import json
from pathlib import Path

import pytest

from benchmarks.diagnosis.gallery import page as pages
from benchmarks.diagnosis.gallery.__main__ import RECORDS
from benchmarks.diagnosis.gallery.overview import overview, rating

ROWS = Path("benchmarks/results/gallery.jsonl")


@pytest.fixture
def rows():
    return pages.read_rows(ROWS)


def row_of(rows, name):
    return next(row for row in rows if row["record"] == name)


def test_the_pages_are_what_the_rows_say(rows):
    assert pages.PAGE.read_text("utf-8") == overview(RECORDS, rows)
    assert {row["record"] for row in rows} == set(RECORDS)
    for row in rows:
        file = pages.FOLDER / f"{row['record']}.md"
        assert file.read_text("utf-8") == pages.page(RECORDS[row["record"]], row)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("ur10e_payload", {"right": False}),
        ("ur10e_payload", {"first": False}),
        ("ur10e_payload", {"causes": []}),
        ("ur10e_payload", {"posterior": []}),
        ("cloud_pendulum", {"verdict": "ambiguous"}),
        ("dfki_pendulum", {"alike": []}),
        ("tx40_friction", {"commit": "0123456789ab"}),
    ],
)
def test_another_answer_is_another_page(rows, name, change):
    """Negative control, of each thing that the tables show."""
    row_of(rows, name).update(change)
    assert pages.PAGE.read_text("utf-8") != overview(RECORDS, rows)


def test_a_size_is_on_the_page(rows):
    mass = row_of(rows, "ur10e_payload")["causes"][0]["parameters"]["mass_kg"]
    size, low, high = (f"{mass[name]:.3g}" for name in ("value", "low", "high"))
    assert f"{size} ({low} to {high}) kg" in overview(RECORDS, rows)
    mass.update(value=1.4, low=0.754, high=2.05)
    assert "1.4 (0.754 to 2.05) kg" in overview(RECORDS, rows)
    mass["low"] = -0.3
    assert "1.4 (−0.3 to 2.05) kg" in overview(RECORDS, rows)


def test_rows_count_by_the_rule(rows):
    """What is right follows from the names, whatever the row says of itself."""
    for row in rows:
        record = RECORDS[row["record"]]
        causes = [cause["effect"] for cause in row["causes"]]
        named = {*causes, *row["alike"]} & set(record.effects)
        assert row["right"] == bool(named)
        assert row["first"] == (causes[:1] != [] and causes[0] in record.effects)


def test_what_is_neither_right_nor_wrong_is_open():
    wrong = {"right": False, "verdict": "found", "causes": [{}]}
    assert rating({**wrong, "right": True}) == "right"
    assert rating(wrong) == rating({**wrong, "verdict": "ambiguous"}) == "wrong"
    for verdict in ("unexplained", "not_observable", "none"):
        assert rating({**wrong, "verdict": verdict}) == "open"


def test_none_of_the_hypotheses_is_not_no_effect(rows):
    """A probability that it is something else makes no effect no likelier."""
    row = row_of(rows, "ur10e_payload")
    joints = {h["joint"]: h for h in row["posterior"] if h["effects"] == []}
    line = next(x for x in overview(RECORDS, rows).splitlines() if "[`ur10e" in x)
    assert "| 1 of 1 |" in line
    joints["shoulder_lift_joint"]["effects"] = None
    line = next(x for x in overview(RECORDS, rows).splitlines() if "[`ur10e" in x)
    assert "| 0 of 1 |" in line


def written(tmp_path, monkeypatch, rows):
    """Runs the command on rows; returns whether it wrote the page of all of them."""
    tmp_path.mkdir(exist_ok=True)
    file, gathered = tmp_path / "rows.jsonl", tmp_path / "gallery.md"
    file.write_text("".join(json.dumps(row) + "\n" for row in rows))
    monkeypatch.setattr(pages, "FOLDER", tmp_path / "gallery")
    monkeypatch.setattr(pages, "PAGE", gathered)
    monkeypatch.setattr("sys.argv", ["page", str(file)])
    assert pages.main() == 0
    assert len(list((tmp_path / "gallery").iterdir())) == len(rows)
    return gathered.exists()


def test_some_of_the_rows_leave_the_page_of_all(tmp_path, monkeypatch, rows, capsys):
    assert not written(tmp_path, monkeypatch, rows[:2])
    assert "2 of 12 records" in capsys.readouterr().out
    assert written(tmp_path / "all", monkeypatch, rows)
