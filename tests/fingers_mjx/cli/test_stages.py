"""The paper's two stages, of its stock comparison: train, adapt, export, evaluate."""

import json

import numpy as np
import pytest

from fingers_mjx.cli.main import main
from fingers_mjx.policy.actor import read
from fingers_mjx.policy.source import load_source
from fingers_mjx.runs.metrics import read_metrics

TINY = [
    *("num_envs=4", "iterations=1", "log_every=1", "checkpoint_every=1"),
    *("ppo.unroll_length=4", "ppo.epochs=1", "ppo.minibatches=2"),
    *("ppo.actor_layers=[16]", "ppo.critic_layers=[16]", "env.episode_s=2"),
    *("env.rewards=stock", "env.weights.feet_air_time=2"),
]
UNLOADED = [
    *("env.randomize.payload_mass_scale=[0.001,0.001]",),
    *("env.randomize.tip_friction=[0.80,0.97]",),
]


@pytest.fixture(scope="module")
def stages(tmp_path_factory):
    path = tmp_path_factory.mktemp("stages")
    walk, adapted = path / "walk", path / "adapted"
    argv = ["train", "crawl", "--backend", "cpu", "--out"]
    first = ["--preset", "paper", "--set", *TINY, *UNLOADED]
    assert main([*argv, str(walk), *first]) == 0
    # A bundle in the run's directory does not make a bundle of the run.
    assert main(["export", str(walk)]) == 0
    second = ["--preset", "adapt", "--warm-start", str(walk), "--schedules", "keep"]
    assert main([*argv, str(adapted), *second, "--set", *TINY]) == 0
    return walk, adapted


def test_the_second_stage_adds_load_and_contacts_and_keeps_the_schedules(stages):
    scales, friction, steps = [], [], []
    for stage in stages:
        arrays, world = read(stage).arrays, "worlds/memory/world/"
        steps.append(np.unique(arrays[f"{world}total_steps"]).tolist())
        scales.append(arrays[f"{world}variation/payload_mass_scale"])
        friction.append(arrays[f"{world}variation/tip_friction"])
    assert steps == [[4], [8]]
    np.testing.assert_allclose(scales, [[0.001] * 4, [1.0] * 4])
    assert np.ptp(friction[0]) <= 0.17 < np.ptp(friction[1])
    presets = [load_source(stage).setup.train.preset for stage in stages]
    assert presets == ["paper", "adapt"]


def test_terms_and_memories_are_those_of_the_stock_table(stages):
    (row,) = read_metrics(stages[0] / "metrics.jsonl")
    assert {"reward/feet_air_time", "reward/flat_orientation"} <= row.keys()
    assert not {"reward/lift", "reward/footprint"} & row.keys()
    names = read(stages[0]).arrays
    assert "worlds/memory/air_time/air_time_s" in names
    assert not [n for n in names if "/lift/" in n or "/footprint/" in n]


def test_a_stock_policy_is_exported_and_evaluated(stages, tmp_path):
    bundle, out = tmp_path / "bundle", tmp_path / "summary.json"
    assert main(["export", str(stages[1]), "--out", str(bundle)]) == 0
    assert load_source(bundle).setup.env.rewards == "stock"
    argv = ["eval", str(bundle), "--episodes", "2", "--steps", "5"]
    assert main([*argv, "--json", str(out)]) == 0
    assert json.loads(out.read_text())["episodes"] == 2
