"""Two policies in the real hand: what is compared, what is refused, and end to end."""

import dataclasses
import json
from typing import Any, cast

import numpy as np
import pytest
from support import effects_hand as rig
from support.cli_setup import make_bundle, make_setup

from envs.hand.hand_file import load_hand_file, save_hand_file
from fingers_mjx.cli.main import main
from fingers_mjx.evaluation.evaluate import EpisodeTable
from fingers_mjx.evaluation.record import Trace
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


def test_a_drift_that_shrinks_is_a_gain_whatever_its_side(tmp_path):
    sources = {n: source(n, tmp_path) for n in ("default", "extended")}
    before = Evaluated(table(), table(turn=-0.1))
    after = Evaluated(table(speed=0.08), table(turn=0.02))
    found = {"default": before, "extended": after}
    document = compared(sources, found, 0, {"steps": STEPS})
    gain = document["gain"]
    assert gain["drift_deg_s"]["mean"] == pytest.approx(np.rad2deg(-0.08))
    assert gain["task_speed_mps"]["mean"] == pytest.approx(0.03)
    shown = document["policies"]["default"]["measures"]["drift_deg_s"]["mean"]
    assert shown == pytest.approx(np.rad2deg(-0.1))
    json.dumps(document, allow_nan=False)
    assert set(columns(before)) == set(gain)


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
    assert main(["sysid", "transfer", *map(str, words), "--set", *small]) == 0
    assert "drift_deg_s" in capsys.readouterr().out
    document = json.loads((out / "transfer.json").read_text())
    policies = document["policies"]
    assert policies["default"]["steps_trained"] == policies["extended"]["steps_trained"]
    hands = [load_hand_file(out / name / "hand.yaml") for name in policies]
    assert not hands[0].effects
    assert hands[1].effects == weak.effects
