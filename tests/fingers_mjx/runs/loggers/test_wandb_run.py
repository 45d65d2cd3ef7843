"""Weights & Biases without network or account; one run, however often it is opened."""

import json

import pytest
from support.logger_files import wandb_runs

from envs.errors import InputError
from fingers_mjx.runs.loggers.base import About, Kept
from fingers_mjx.runs.loggers.wandb_run import ID_FILE, WandbRun

pytest.importorskip("wandb", reason="the extra wandb is not installed")

ABOUT = About("00", "walk", {"train": {"seed": 3}})


@pytest.fixture(autouse=True)
def nowhere_else(monkeypatch, tmp_path):
    """Neither an account nor settings of whoever runs the tests."""
    for name in ("WANDB_MODE", "WANDB_PROJECT", "WANDB_API_KEY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))


def row(iteration, **numbers):
    return {"iteration": iteration, "time_s": 1e9 + iteration, **numbers}


def kept(path, *rows):
    path.mkdir(exist_ok=True)
    return Kept(path, rows, {})


def curve(rows):
    return [(r["iteration"], r["kl"]) for r in rows]


def test_rows_names_and_settings_are_in_the_run_directory(tmp_path):
    run = WandbRun(ABOUT, kept(tmp_path / "run"))
    run.append(row(2, kl=0.5, note="text"))
    run.close()
    [(made, rows)] = wandb_runs(tmp_path / "run")
    assert curve(rows) == [(2, 0.5)] and "note" not in rows[0]
    assert (made.project, made.run_group, made.display_name) == (
        "fingers_mjx",
        "walk",
        "00",
    )
    config = {u.key: json.loads(u.value_json) for u in made.config.update}
    assert config["train"] == {"seed": 3}


def test_a_resumed_run_is_the_same_run(tmp_path):
    for iterations in ((1, 2), (3,)):
        # What is kept was logged before, and is not logged again.
        run = WandbRun(
            ABOUT, kept(tmp_path / "run", *map(row, range(1, iterations[0])))
        )
        for iteration in iterations:
            run.append(row(iteration, kl=iteration / 10))
        run.close()
    (first, before), (second, after) = wandb_runs(tmp_path / "run")
    assert first.run_id == second.run_id
    assert first.run_id == (tmp_path / "run" / ID_FILE).read_text("utf-8").strip()
    assert curve(before + after) == [(1, 0.1), (2, 0.2), (3, 0.3)]


def test_a_run_that_had_no_such_logger_brings_what_it_has(tmp_path):
    WandbRun(ABOUT, kept(tmp_path / "run", row(1, kl=0.1), row(2, kl=0.2))).close()
    [(_, rows)] = wandb_runs(tmp_path / "run")
    assert curve(rows) == [(1, 0.1), (2, 0.2)]


def test_members_are_runs_of_their_own_side_by_side(tmp_path):
    runs = [
        WandbRun(About(name, "walk", {}), kept(tmp_path / name))
        for name in ("00", "01")
    ]
    for number, run in enumerate(runs):
        run.append(row(1, kl=float(number)))
    for run in runs:
        run.close()
    [(one, of_one)], [(two, of_two)] = (wandb_runs(tmp_path / n) for n in ("00", "01"))
    assert one.run_id != two.run_id and one.run_group == two.run_group == "walk"
    assert (of_one[0]["kl"], of_two[0]["kl"]) == (0.0, 1.0)


def test_offline_wandb_does_not_report_on_itself(tmp_path):
    WandbRun(ABOUT, kept(tmp_path / "run")).close()
    from wandb.env import error_reporting_enabled

    assert not error_reporting_enabled()


def test_an_unknown_mode_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("WANDB_MODE", "ofline")
    with pytest.raises(InputError, match="did you mean offline"):
        WandbRun(ABOUT, kept(tmp_path / "run"))
