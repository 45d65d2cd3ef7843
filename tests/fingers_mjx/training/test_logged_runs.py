"""Optional loggers while training: they follow it, and change nothing."""

import pytest
from support.logger_files import wandb_runs
from support.train_setup import assert_same_end, run, setup

from fingers_mjx.training.member import Place, about


@pytest.fixture(autouse=True)
def offline(monkeypatch, tmp_path):
    monkeypatch.delenv("WANDB_MODE", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))


def test_a_resumed_run_goes_on_in_the_same_place_and_learns_the_same(tmp_path):
    pytest.importorskip("wandb", reason="the extra wandb is not installed")
    pytest.importorskip("rerun", reason="the extra rerun is not installed")
    run(tmp_path / "plain", iterations=4)
    both = ("wandb", "rerun")
    run(tmp_path / "logged", iterations=2, loggers=both)
    run(tmp_path / "logged", resume=True, iterations=4, loggers=both)
    assert_same_end(tmp_path / "plain", tmp_path / "logged")
    (one, before), (two, after) = wandb_runs(tmp_path / "logged")
    assert (one.run_id, one.run_group) == (two.run_id, "")
    assert [r["iteration"] for r in before + after] == [1, 2, 3, 4]
    assert (tmp_path / "logged/metrics.rrd").stat().st_size > 10_000


def test_members_of_a_population_are_runs_of_one_group(tmp_path):
    def named(*folders):
        places = [Place("", tmp_path / f, setup(), {}) for f in folders]
        return [(run.group, run.name) for run in about(places)]

    assert named("walk") == [("", "walk")]
    assert named("walk/members/00", "walk/members/01") == [
        ("walk", "00"),
        ("walk", "01"),
    ]
    sweep = named("study/heavy/0/first", "study/light/0/first")
    assert sweep == [("study", "heavy/0/first"), ("study", "light/0/first")]
