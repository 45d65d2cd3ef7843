"""Policies in the real hand: what is compared, what is refused, and end to end."""

import dataclasses
import json
from typing import Any, cast

import numpy as np
import pytest
from support import effects_hand as rig
from support.cli_setup import make_bundle, make_setup

from envs.errors import InputError
from envs.hand.hand_file import load_hand_file, save_hand_file
from fingers_mjx.cli.main import main
from fingers_mjx.evaluation.evaluate import EpisodeTable
from fingers_mjx.evaluation.record import Trace
from fingers_mjx.studies.statistics.compare import ONE_SEED
from fingers_mjx.studies.transfer import Evaluated, columns, compared, drift

STEPS, EPISODES = 20, 3
FIELDS = dataclasses.fields(cast(Any, Trace))


def table(turn=0.0, sideways=0.0, falls=(), speed=0.05):
    """Episodes that turn and slip sideways; `falls` are (episode, step)."""
    shape = (STEPS, EPISODES)
    done = np.zeros(shape, bool)
    done[-1] = True
    failed = np.zeros(shape, bool)
    for episode, step in falls:
        done[step, episode] = failed[step, episode] = True
    empty: dict[str, Any] = {f.name: np.zeros(shape) for f in FIELDS}
    empty |= {
        "vel_v": np.stack([np.full(shape, speed), np.full(shape, sideways)], -1),
        "yaw_rate": np.full(shape, turn),
        "done": done,
        "failed": failed,
        "extra": {},
    }
    measures = {
        "task_speed_mps": np.full(EPISODES, speed),
        "survival": 1.0 - failed.any(0),
        "turn_rate_error_rad_s": np.full(EPISODES, abs(turn)),
    }
    return EpisodeTable(measures, Trace(**empty), 0.02)


def test_drift_is_what_happens_before_a_fall():
    one = table(turn=np.deg2rad(-6.0), sideways=0.01, falls=[(1, 5)])
    one.traces.yaw_rate[6:, 1] = 100.0
    found = drift(one)
    assert found["drift_deg_s"] == pytest.approx([-6.0] * EPISODES)
    assert found["sideways_mps"] == pytest.approx([0.01] * EPISODES)


def source(name, tmp_path):
    from fingers_mjx.policy.source import load_source

    return load_source(make_bundle(tmp_path / name, make_setup()))


def arms(tmp_path, before, after, seeds):
    """The document of as many policies of each arm as there are evaluations."""
    one = source("policy", tmp_path)
    found = {"default": before, "extended": after}
    sources = {name: [one] * len(arm) for name, arm in found.items()}
    return compared(sources, found, seeds, 0, {"steps": STEPS})


def test_a_drift_that_shrinks_is_a_gain_whatever_its_side(tmp_path):
    before = [Evaluated(table(), table(turn=turn)) for turn in (-0.10, 0.12, -0.15)]
    after = [
        Evaluated(table(speed=speed), table(turn=0.02)) for speed in (0.08, 0.09, 0.07)
    ]
    document = arms(tmp_path, before, after, (4, 5, 6))
    drift_gain, speed = (document["gain"][n] for n in ("drift_deg_s", "task_speed_mps"))
    sizes = np.rad2deg([0.10, 0.12, 0.15])
    assert drift_gain["mean"] == pytest.approx(np.rad2deg(0.02) - sizes.mean())
    assert drift_gain["values"]["default"] == pytest.approx(list(sizes))
    assert (drift_gain["better"], drift_gain["in_favour"]) == ("lower", 3)
    assert drift_gain["low"] < drift_gain["mean"] < drift_gain["high"] < 0
    assert speed["mean"] == pytest.approx(0.03)
    assert speed["p"] < speed["p_holm"]
    shown = document["policies"]["default"][0]["measures"]["drift_deg_s"]["mean"]
    assert shown == pytest.approx(np.rad2deg(-0.1))
    assert document["seeds"] == [4, 5, 6]
    assert "over_worlds" not in document
    json.dumps(document, allow_nan=False)
    assert set(columns(before[0])) == set(document["gain"])


def test_one_seed_has_no_interval_over_seeds_but_one_over_worlds(tmp_path):
    before, after = (Evaluated(table(), table(turn=turn)) for turn in (-0.1, 0.02))
    document = arms(tmp_path, [before], [after], (0,))
    gain = document["gain"]["drift_deg_s"]
    assert gain["mean"] == pytest.approx(np.rad2deg(-0.08))
    assert (gain["n"], gain["low"], gain["p"], gain["note"]) == (
        1,
        None,
        None,
        ONE_SEED,
    )
    worlds = document["over_worlds"]["drift_deg_s"]
    assert (worlds["n"], worlds["mean"]) == (EPISODES, pytest.approx(gain["mean"]))


def test_arms_of_different_size_are_refused(tmp_path):
    one = Evaluated(table(), table())
    with pytest.raises(InputError, match="2 and 1"):
        arms(tmp_path, [one, one], [one], (0, 1))


def refused(capsys, *words):
    assert main(["sysid", "transfer", *map(str, words)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    return error


def test_what_cannot_be_compared_is_refused(tmp_path, capsys):
    real = tmp_path / "real.yaml"
    save_hand_file(load_hand_file(), real)
    out = ("-o", tmp_path / "out")
    assert "found neither" in refused(capsys, "--real", real, *out)
    policies = ("--policies", "a", "b", "--seeds", 2)
    assert "every pair is a seed" in refused(capsys, "--real", real, *policies, *out)
    same = refused(capsys, "--real", real, "--extended", real, *out)
    assert "the same hand" in same
    lost = refused(capsys, "--real", tmp_path / "no.yaml", "--extended", real, *out)
    assert "no.yaml" in lost
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_both_are_trained_and_walk_in_the_real_hand(tmp_path, capsys):
    weak = rig.hand_with(rig.entry("finger_weakness", ("index",), strength=0.6))
    for name in ("real", "extended"):
        save_hand_file(weak, tmp_path / f"{name}.yaml")
    small = ("num_envs=4", "iterations=1", "log_every=1", "checkpoint_every=1",
             "ppo.unroll_length=4", "ppo.epochs=1", "ppo.minibatches=2",
             "ppo.actor_layers=[16]", "ppo.critic_layers=[16]")  # fmt: skip
    out = tmp_path / "out"
    words = ["--real", tmp_path / "real.yaml", "--extended", tmp_path / "extended.yaml"]
    words += ["--backend", "cpu", "--episodes", 2, "--steps", 5, "-o", out]
    words += ["--seeds", 2, "--seed", 7]
    assert main(["sysid", "transfer", *map(str, words), "--set", *small]) == 0
    assert "drift_deg_s" in capsys.readouterr().out
    document = json.loads((out / "transfer.json").read_text())
    steps = [
        one["steps_trained"] for arm in document["policies"].values() for one in arm
    ]
    assert len(steps) == 4 and len(set(steps)) == 1
    assert document["gain"]["drift_deg_s"]["n"] == 2
    hands = [
        load_hand_file(out / name / "8" / "hand.yaml")
        for name in ("default", "extended")
    ]
    assert not hands[0].effects
    assert hands[1].effects == weak.effects
    checkpoints = {p: p.stat().st_mtime_ns for p in out.rglob("checkpoints/*")}
    assert main(["sysid", "transfer", *map(str, words), "--set", *small]) == 0
    assert {p: p.stat().st_mtime_ns for p in out.rglob("checkpoints/*")} == checkpoints
    again = json.loads((out / "transfer.json").read_text())
    assert again["gain"] == document["gain"]
