import json
import math

import pytest
from support.synthetic_sweep import STEPS, study, write_evaluation, write_sweep

from envs.errors import InputError
from fingers_mjx.studies.comparison.results import read_results
from fingers_mjx.studies.sweep.manifest import read_manifest


def read(path):
    return read_results(path, read_manifest(path))


def test_values_are_those_of_the_evaluations(tmp_path):
    values = study({"lift": 0.02}, 3)
    values["lift"][1]["task_speed_mps"] = math.nan
    found = read(write_sweep(tmp_path / "s", values))
    assert found.configurations == ("base", "lift")
    assert not found.missing
    speeds = found.values["base"]["task_speed_mps"]
    assert speeds == {s: values["base"][s]["task_speed_mps"] for s in range(3)}
    assert math.isnan(found.values["lift"]["task_speed_mps"][1])
    assert found.steps["lift"] == dict.fromkeys(range(3), 2 * STEPS)
    assert "task_speed_mps" in found.measures


def test_a_measure_that_nobody_defines_is_none(tmp_path):
    values = {name: {0: {"survival": 1.0, "x": math.nan}} for name in ("a", "b")}
    assert read(write_sweep(tmp_path / "s", values)).measures == ["survival"]


def test_a_member_that_is_not_done_is_missing_with_its_reason(tmp_path):
    states = {("lift", 1): ("failed", "out of memory"), ("base", 2): ("waiting", "")}
    path = write_sweep(tmp_path / "s", study({"lift": 0.02}, 3), states)
    for seed, text in ((0, "{"), (2, '{"measures": {"survival": 1.0}}')):
        file = path / "runs" / "lift" / str(seed) / "walk" / "eval" / "summary.json"
        file.write_text(text)
    (path / "runs" / "base" / "0" / "walk" / "eval" / "summary.json").unlink()
    missing = {m.name: m.reason for m in read(path).missing}
    assert set(missing) == {"lift/0", "lift/1", "lift/2", "base/0", "base/2"}
    assert "failed in walk after 4 iterations: out of memory" in missing["lift/1"]
    assert missing["base/2"].startswith("waiting")
    assert all("cannot be read" in missing[name] for name in ("lift/0", "lift/2"))
    assert "without an evaluation" in missing["base/0"]


@pytest.mark.parametrize(
    "change", [{"episodes": 64}, {"seed": 7}, {"conditions": {"nominal": True}}]
)
def test_evaluations_made_in_different_ways_are_not_compared(tmp_path, change):
    path = write_sweep(tmp_path / "s", study({"lift": 0.02}, 2))
    write_evaluation(path / "runs/lift/1/walk", {"survival": 1.0}, **change)
    with pytest.raises(InputError, match=rf"lift/1: {next(iter(change))}.*base/0"):
        read(path)


def test_names_lead_nowhere_else(tmp_path):
    path = write_sweep(tmp_path / "s", study({"lift": 0.02}, 2))
    text = (path / "sweep.json").read_text().replace('"lift"', '"../../lift"')
    assert json.loads(text)
    (path / "sweep.json").write_text(text)
    with pytest.raises(InputError, match="name of a directory"):
        read(path)
