"""People bring tasks of their own: one file and one call, no change to the packages."""

import json
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from support.few import FEW

from envs import registry
from fingers_mjx.cli.main import main

EXAMPLE = Path(__file__).parents[2] / "examples/outside_task"
SETTINGS = ("num_envs=4", *FEW, "env.episode_s=0.2", "env.height_m=0.08")


@pytest.fixture
def table(monkeypatch):
    """The reward table of the example's task, which one call has registered."""
    monkeypatch.syspath_prepend(EXAMPLE)
    monkeypatch.setattr(registry, "_TASKS", dict(registry._TASKS))
    registry.register("crouch", import_module("outside_task.settings").CROUCH)
    return import_module("outside_task.task").TABLE


def test_a_task_from_outside_trains(table, tmp_path, capsys):
    run = tmp_path / "run"
    argv = ["train", "crouch", "--preset", "cpu", "--out", str(run), "--set"]
    assert main([*argv, *SETTINGS]) == 0, capsys.readouterr().err
    lines = (run / "metrics.jsonl").read_text("utf-8").splitlines()
    rows = [json.loads(line) for line in lines]
    assert [row["iteration"] for row in rows] == [1, 2]
    for term in table:
        assert np.isfinite([row[f"reward/{term.name}"] for row in rows]).all()
    assert rows[-1]["reward/low"] > 0 and rows[-1]["height_m"] > 0.08


def test_its_name_is_unknown_without_the_call(tmp_path, capsys):
    """Negative control."""
    assert main(["train", "crouch", "--out", str(tmp_path / "run")]) == 2
    assert "crouch" in capsys.readouterr().err
