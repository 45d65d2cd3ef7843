"""People bring tasks of their own: one file and one call, no change to the packages."""

import json

import numpy as np
import pytest
from support.outside_task import CROUCH, register_crouch

from envs import registry
from fingers_mjx.cli.main import main

FEW = (
    "num_envs=4",
    "iterations=2",
    "log_every=1",
    "ppo.unroll_length=6",
    "ppo.minibatches=2",
    "ppo.actor_layers=[16]",
    "ppo.critic_layers=[16]",
    "env.episode_s=0.2",
    "env.height_m=0.08",
)


@pytest.fixture
def crouch(monkeypatch):
    monkeypatch.setattr(registry, "_TASKS", dict(registry._TASKS))
    register_crouch()


def test_a_task_from_outside_trains(crouch, tmp_path, capsys):
    run = tmp_path / "run"
    argv = ["train", "crouch", "--preset", "cpu", "--out", str(run), "--set", *FEW]
    assert main(argv) == 0, capsys.readouterr().err
    lines = (run / "metrics.jsonl").read_text("utf-8").splitlines()
    rows = [json.loads(line) for line in lines]
    assert [row["iteration"] for row in rows] == [1, 2]
    for term in CROUCH:
        assert np.isfinite([row[f"reward/{term.name}"] for row in rows]).all()
    assert rows[-1]["reward/low"] > 0 and rows[-1]["height_m"] > 0.08


def test_its_name_is_unknown_without_the_call(tmp_path, capsys):
    """Negative control."""
    assert main(["train", "crouch", "--out", str(tmp_path / "run")]) == 2
    assert "crouch" in capsys.readouterr().err
