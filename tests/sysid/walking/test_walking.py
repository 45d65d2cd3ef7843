"""A cause is named from the log of a walk, and only one that is there."""

import dataclasses
import json
from pathlib import Path

import jax
import numpy as np
import pytest
from support import effects_hand as rig

import fingers_mjx
from envs.errors import InputError
from envs.hand.hand_file import load_hand_file, save_hand_file
from fingers_mjx.cli.main import main
from fingers_mjx.cli.sysid.diagnose import walk_setup
from fingers_mjx.evaluation.setups import nominal
from fingers_mjx.play.episodes import schedule_of
from fingers_mjx.play.log import WalkNoise, WalkRecorder
from fingers_mjx.policy.source import load_bundle_setup
from fingers_mjx.runs.setup import make_env
from sysid.logs.log import make_log
from sysid.logs.read import write_log
from sysid.walking.hypotheses import axes, candidate, hypotheses
from sysid.walking.record import walk_record
from sysid.walking.simulation import Pieces
from sysid.walking.verdict import Judged, verdict_of

CRAWL = Path(fingers_mjx.__file__).parent / "policies" / "crawl"
COMMANDS = [(0.10, 0.0, 0.0), (0.08, 0.05, 0.0), (0.10, 0.0, 0.3), (0.10, 0.0, 0.0)]
STRENGTH = 0.65


def walked(seconds, *effects, noise=None):
    """The log of a walk of the committed policy, of a hand that has effects."""
    bundle, setup = load_bundle_setup(CRAWL)
    setup = nominal(setup)
    hand = dataclasses.replace(setup.hand, effects=effects)
    env = dataclasses.replace(setup.env, episode_s=1000.0)
    setup = dataclasses.replace(setup, hand=hand, env=env)
    recorder = WalkRecorder(make_env(setup, 1, "cpu"), bundle)
    steps = round(seconds * 50)
    recorder.play(jax.random.key(3), steps, schedule_of(COMMANDS, steps))
    return recorder.log(np.random.default_rng(1), noise)


@pytest.fixture(scope="module")
def weak():
    effect = rig.entry("finger_weakness", ("middle",), strength=STRENGTH)
    return walked(11.0, effect, noise=WalkNoise(3e-5, 0.0, 0.0, 0.0, 3e-5, 1e-4))


@pytest.fixture(scope="module")
def env():
    return make_env(walk_setup(load_hand_file()), 1, "cpu")


def test_short_walks_of_the_true_hand_miss_less(weak, env):
    pieces = Pieces(env, walk_record(weak, env))
    found = {}
    for name, strength in (("true", STRENGTH), ("plain", 1.0), ("wrong", 1.4)):
        theta = [
            np.log(strength) / a.unit if a.where == "middle" else 0.0 for a in axes()
        ]
        missed = pieces.misses(candidate(np.array(theta), axes()))
        assert missed.shape == (len(pieces.starts), 2, 26)
        found[name] = np.median(np.abs(missed[:, 1, 6 + 8 : 6 + 12]))
    assert found["true"] < 0.4 * found["plain"] < 0.4 * found["wrong"]


def test_a_walk_that_cannot_be_used_is_refused(weak, env):
    def changed(match, t_s=weak.t_s, mounting="free", drop="", columns=None):
        kept = {k: v for k, v in weak.columns.items() if k != drop}
        kept |= columns or {}
        log = make_log(weak.header.joints, t_s, kept, mounting=mounting)
        with pytest.raises(InputError, match=match):
            walk_record(log, env)

    changed("mounting", mounting="palm_fixed")
    changed(r"a row every 0\.02 s", t_s=weak.t_s * 1.5)
    changed(r"no base\.qw", drop="base.qw")
    holes = np.where(np.arange(len(weak)) == 7, np.nan, weak.column("gyro.x"))
    changed("missing readings", columns={"gyro.x": holes})


def judged(index, gains):
    chosen = hypotheses(axes())[index]
    theta = np.zeros(len(axes()))
    theta[list(chosen.indices)] = -3.0
    return Judged(chosen, np.asarray(gains, float), theta, np.full(len(theta), 0.5))


def test_a_verdict_asks_for_more_than_chance():
    plain = judged(0, np.full(10, -1000.0))
    count = np.full(10, 2000)
    rng = np.random.default_rng(2)
    chance = [judged(i, rng.normal(0.0, 5.0, 10)) for i in range(3)]
    assert verdict_of(axes(), chance, plain, count)["verdict"] == "none"
    clear = [judged(2, rng.normal(50.0, 5.0, 10)), *chance[:2]]
    found = verdict_of(axes(), clear, plain, count)
    assert found["verdict"] == "found"
    (cause,) = found["causes"]
    assert (cause.effect, cause.where) == ("finger_weakness", "middle")
    strength = cause.parameters["strength"]
    assert strength.value == pytest.approx(np.exp(-0.3))
    assert strength.low < strength.value < strength.high < 1.0
    other = judged(6, clear[0].gains + rng.normal(0.0, 5.0, 10))
    found = verdict_of(axes(), [clear[0], other], plain, count)
    assert found["verdict"] == "ambiguous"
    assert not found["alternatives"][0].distinguishable


@pytest.mark.slow
@pytest.mark.parametrize("hidden", [True, False])
def test_a_weak_finger_is_named_from_half_a_minute(tmp_path, hidden):
    effect = rig.entry("finger_weakness", ("middle",), strength=STRENGTH)
    write_log(walked(30.0, *[effect] * hidden), tmp_path / "walk.parquet")
    words = ["diagnose", str(tmp_path / "walk.parquet"), "-o", str(tmp_path / "out")]
    assert main(["sysid", *words]) == 0
    found = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    if not hidden:
        assert found["verdict"] == "none"
        return
    assert found["verdict"] == "found"
    (cause,) = found["causes"]
    assert (cause["effect"], cause["where"]) == ("finger_weakness", "middle")
    strength = cause["parameters"]["strength"]
    assert strength["value"] == pytest.approx(STRENGTH, abs=0.08)
    hand = load_hand_file(tmp_path / "out" / "hand.yaml")
    assert hand.effects[0].name == "finger_weakness"
    save_hand_file(hand, tmp_path / "again.yaml")
