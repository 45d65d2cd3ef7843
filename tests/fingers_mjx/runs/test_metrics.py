import json
import os

import pytest

from envs.errors import InputError
from fingers_mjx.runs.metrics import last_row, read_metrics

ROW = {"iteration": 3, "time_s": 1.5, "loss": 0.1, "note": None}


def written(path, *lines):
    path.write_text("".join(f"{line}\n" for line in lines), "utf-8")
    return path


@pytest.mark.parametrize(
    "bad",
    [
        "[]",
        "7",
        "{}",
        json.dumps({**ROW, "iteration": "3"}),
        json.dumps({**ROW, "iteration": True}),
        json.dumps({**ROW, "time_s": None}),
        json.dumps({**ROW, "loss": {"a": 1}}),
        json.dumps({**ROW, "loss": [1]}),
    ],
)
def test_a_line_that_is_no_row_is_named(tmp_path, bad):
    path = written(tmp_path / "metrics.jsonl", json.dumps(ROW), bad)
    with pytest.raises(InputError, match="line 2"):
        read_metrics(path)
    assert type(last_row(path)["iteration"]) is int


@pytest.mark.parametrize("cut", ['{"iter', "[" * 10_000, '{"a":' * 1000, "\ufffd"])
def test_what_a_kill_has_cut_ends_the_curve(tmp_path, cut):
    path = written(tmp_path / "metrics.jsonl", json.dumps(ROW), cut)
    assert read_metrics(path) == [ROW] and last_row(path) == ROW


@pytest.mark.parametrize("read", [read_metrics, last_row])
def test_only_regular_files_are_read(tmp_path, read):
    path = tmp_path / "metrics.jsonl"
    assert not read(path)
    os.mkfifo(path)
    with pytest.raises(InputError, match="named pipe"):
        read(path)
