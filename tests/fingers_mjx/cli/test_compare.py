"""`fingers compare` as a user types it: table, files, refusals."""

import json

import pyarrow.parquet as pq
import pytest
from support.synthetic_sweep import study, write_sweep

from fingers_mjx.cli.main import main

GAINS = {"lift": [0.02, 0.03, 0.025, 0.015]}
FAILED = {("lift", 2): ("failed", "out of memory")}


def compare(*words):
    return main(["compare", *map(str, words)])


def test_table_json_parquet_and_page(tmp_path, capsys):
    path = write_sweep(tmp_path / "s", study(GAINS, 4))
    assert compare(path, "--baseline", "base", "--measures", "task_speed_mps") == 0
    shown = capsys.readouterr().out
    assert "+0.0225" in shown and "4\N{NO-BREAK SPACE}of\N{NO-BREAK SPACE}4" in shown
    out = path / "comparison"
    found = json.loads((out / "comparison.json").read_text())
    (row,) = found["differences"]
    assert row["difference"]["mean"] == pytest.approx(0.0225)
    assert found["read_together"] == 1 and found["missing"] == []
    table = pq.read_table(out / "comparison.parquet").to_pylist()
    assert table[0]["mean"] == row["difference"]["mean"]
    assert table[0]["p_holm"] == row["p_holm"]
    values = pq.read_table(out / "values.parquet").to_pylist()
    assert len(values) == 8
    assert {v["configuration"] for v in values} == {"base", "lift"}
    assert (out / "comparison.html").stat().st_size > 50_000


def test_the_same_sweep_gives_the_same_numbers(tmp_path):
    path = write_sweep(tmp_path / "s", study(GAINS, 4), curves=False)
    for name in ("one", "two"):
        assert compare(path, "--baseline", "base", "-o", tmp_path / name) == 0
    one, two = ((tmp_path / n / "comparison.json").read_text() for n in ("one", "two"))
    assert one == two


def refused(capsys, *words):
    assert compare(*words) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    return error


def test_a_sweep_with_missing_seeds_is_refused_unless_allowed(tmp_path, capsys):
    path = write_sweep(tmp_path / "s", study(GAINS, 4), FAILED)
    error = refused(capsys, path, "--baseline", "base")
    assert "lift/2" in error and "--allow-partial" in error
    assert not (path / "comparison").exists()
    assert compare(path, "--baseline", "base", "--allow-partial") == 0
    assert "Missing: lift/2, failed" in capsys.readouterr().out
    found = json.loads((path / "comparison" / "comparison.json").read_text())
    assert found["missing"][0]["seed"] == 2
    assert {row["difference"]["n"] for row in found["differences"]} == {3}


def test_one_seed_says_that_it_proves_nothing(tmp_path, capsys):
    path = write_sweep(tmp_path / "s", study({"lift": 0.02}, 1))
    assert compare(path, "--baseline", "base") == 0
    assert "One seed per arm proves nothing" in capsys.readouterr().out


def test_what_cannot_be_compared_is_refused_in_one_sentence(tmp_path, capsys):
    path = write_sweep(tmp_path / "s", study(GAINS, 4), curves=False)
    assert "one of base, lift" in refused(capsys, path)
    assert "one of base, lift" in refused(capsys, path, "--baseline", "lifd")
    words = (path, "--baseline", "base", "--measures", "speed")
    assert "task_speed_mps" in refused(capsys, *words)
    assert "fingers sweep" in refused(capsys, tmp_path, "--baseline", "base")
    (path / "sweep.json").write_text('{"format": 1}')
    assert "sweep.json" in refused(capsys, path, "--baseline", "base")
