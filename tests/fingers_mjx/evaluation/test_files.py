import json

import numpy as np
import pyarrow.parquet as pq
import pytest

from envs.errors import InputError
from fingers_mjx.evaluation.files import (
    read_table,
    summary_document,
    write_summary,
    write_table,
)

COLUMNS = {
    "task_speed_mps": np.array([0.1, 0.2, np.nan, 0.3]),
    "survival": np.array([1.0, 1.0, 0.0, 1.0]),
    "mean_contact_tilt_deg": np.full(4, np.nan),
}


def test_table_comes_back_with_its_description(tmp_path):
    path = write_table(tmp_path / "episodes.parquet", COLUMNS, {"task": "crawl"})
    found = read_table(path)
    np.testing.assert_array_equal(found.pop("episode"), np.arange(4))
    assert found.keys() == COLUMNS.keys()
    for name, values in COLUMNS.items():
        np.testing.assert_array_equal(found[name], values)
    assert pq.read_schema(path).metadata[b"task"] == b"crawl"


@pytest.mark.parametrize("content", [b"", b"PAR1 but not really"])
def test_no_table_is_one_sentence(tmp_path, content):
    path = tmp_path / "episodes.parquet"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"episodes\.parquet.*a Parquet table"):
        read_table(path)


def test_a_table_that_is_not_there_is_one_sentence(tmp_path):
    missing = r"episodes\.parquet: found No such file .*; valid: a regular file"
    with pytest.raises(InputError, match=missing):
        read_table(tmp_path / "episodes.parquet")


def test_summary_has_what_readers_rely_on(tmp_path):
    document = summary_document(COLUMNS, "crawl", "bundle", 3, 1_000, commit="abc")
    path = write_summary(tmp_path / "eval.json", document)
    found = json.loads(path.read_text(encoding="utf-8"), parse_constant=pytest.fail)
    measures = found.pop("measures")
    assert found == {
        "task": "crawl",
        "policy": "bundle",
        "episodes": 4,
        "seed": 3,
        "steps_trained": 1_000,
        "commit": "abc",
    }
    assert measures.keys() == COLUMNS.keys()
    speed = measures["task_speed_mps"]
    assert speed.keys() == {"mean", "std", "n", "low", "high", "median", "p95"}
    assert speed["n"] == 3
    np.testing.assert_allclose([speed["mean"], speed["std"]], [0.2, 0.1])
    assert measures["survival"]["mean"] == 0.75
    undefined = dict.fromkeys(("mean", "std", "low", "high", "median", "p95")) | {
        "n": 0
    }
    assert measures["mean_contact_tilt_deg"] == undefined
    assert "commit" not in summary_document(COLUMNS, "crawl", "bundle", 3, 1_000)


def test_episodes_of_one_unit_count_once():
    """Of three poses one was drawn six times: it says no more for that."""
    columns = {
        "righted": np.array([0.0] * 6 + [1.0, 1.0]),
        "time_s": np.array([np.nan] * 6 + [2.0, 4.0]),
        "unit": np.array([5.0] * 6 + [1.0, 2.0]),
    }
    found = summary_document(columns, "recovery", "p", 0, 1)
    assert (found["episodes"], found["units"]) == (8, 3)
    assert set(found["measures"]) == {"righted", "time_s"}
    assert found["measures"]["righted"]["mean"] == pytest.approx(2 / 3)
    assert found["measures"]["righted"]["n"] == 3
    assert found["measures"]["time_s"]["mean"] == 3.0
    without = {k: v for k, v in columns.items() if k != "unit"}
    plain = summary_document(without, "recovery", "p", 0, 1)
    assert "units" not in plain
    assert plain["measures"]["righted"]["mean"] == 0.25
    assert plain["measures"]["righted"]["high"] < found["measures"]["righted"]["high"]
