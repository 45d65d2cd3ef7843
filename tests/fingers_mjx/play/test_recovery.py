"""Recovery in the closed loop ends as the shim ends it, and hands over."""

import dataclasses
from typing import Any

import jax
import numpy as np
import pytest
from support.cli_setup import TRAIN, make_bundle, make_setup, random_weights

from envs.errors import InputError
from envs.tasks.recovery.falls import Falls
from fingers_deploy import PolicyController, load_bundle
from fingers_deploy.rotations import gravity
from fingers_mjx.cli.main import main
from fingers_mjx.evaluation.setups import as_deployed, nominal
from fingers_mjx.play.behaviours import Behaviours, orientation_of, sticks_for
from fingers_mjx.play.episodes import play_episodes
from fingers_mjx.play.player import Player
from fingers_mjx.play.recovery import RecoveryPlayer, check_chain, story
from fingers_mjx.runs.setup import make_env, new_setup
from fingers_robot.behaviour.command import stick_command

SEED = 20260125
DT_S = 0.02
RANGES = ((0.0, 0.16), (-0.16, 0.16), (-0.45, 0.45))


@pytest.fixture(scope="module")
def setup():
    return nominal(new_setup(dataclasses.replace(TRAIN, task="recovery"), None))


@pytest.fixture(scope="module")
def recovery(setup, tmp_path_factory):
    """A policy that hardly moves."""
    weights = random_weights(clip=setup.env.action_clip, gain=0.0)
    weights = dataclasses.replace(
        weights, layers=tuple((k, 0.02 * b) for k, b in weights.layers)
    )
    path = tmp_path_factory.mktemp("recovery") / "still"
    return load_bundle(make_bundle(path, setup, weights))


@pytest.fixture(scope="module")
def crawl(tmp_path_factory):
    path = tmp_path_factory.mktemp("crawl") / "walker"
    return load_bundle(make_bundle(path, make_setup()))


@pytest.fixture(scope="module")
def fallen(setup):
    return make_env(setup, 1, "cpu")


@pytest.fixture(scope="module")
def standing(setup):
    """Worlds in which the hand has not fallen at all."""
    batch = make_env(setup, 1, "cpu")
    stance = batch.stance
    upright = Falls(("wrist",), (stance.qpos,), (stance.target_rad,), "")
    env: Any = batch.env
    env.task = dataclasses.replace(env.task, falls=upright)
    return batch


def test_an_orientation_has_the_gravity_that_it_was_made_for():
    print("seed", SEED)
    down = np.random.default_rng(SEED).normal(size=(50, 3))
    down /= np.linalg.norm(down, axis=1, keepdims=True)
    for one in (*down, np.array([0, 0, 1.0]), np.array([0, 0, -1.0])):
        np.testing.assert_allclose(gravity(orientation_of(one)), one, atol=1e-9)


@pytest.mark.parametrize(
    "command", [(0.16, 0.0, 0.0), (0.05, -0.12, 0.3), (0.0, 0.16, -0.45)]
)
def test_sticks_ask_for_the_command(command):
    asked = stick_command(sticks_for(command, RANGES), RANGES)
    np.testing.assert_allclose(asked, command, atol=1e-9)


def test_a_command_outside_the_training_range_is_refused():
    with pytest.raises(InputError, match=r"\[0\]: found -0.01; valid: 0 to 0.16"):
        sticks_for((-0.01, 0.0, 0.0), RANGES)


def test_before_the_detector_fires_the_policy_runs_as_by_itself(recovery):
    rng = np.random.default_rng(SEED)
    shim, alone = Behaviours(recovery), PolicyController(recovery, "auto")
    start = rng.uniform(-0.2, 0.2, 20)
    shim.reset(start)
    alone.reset(start)
    for _ in range(40):
        joints, rates = rng.normal(0, 0.3, 20), rng.normal(0, 0.3, 3)
        side = np.array([0.0, 1.0, 0.0])
        inputs = (joints, side, rates, np.zeros(3))
        np.testing.assert_allclose(shim.step(*inputs), alone.step(*inputs), atol=1e-6)
    assert not shim.settling


def test_a_hand_that_stays_down_is_reported_plainly(fallen, recovery, crawl):
    player = RecoveryPlayer(fallen, recovery, crawl)
    session = play_episodes(player, 1, 40)
    columns = session.table.columns
    assert columns["righted"][0] == 0 and np.isnan(columns["time_to_upright_s"][0])
    assert story(session.first, DT_S, "crawl") == (
        "the hand was never upright for 0.5 s within 0.8 s; crawl did not run"
    )
    assert not player.behaviours.handed_over
    # The same hand without the shim's behaviours.
    key = jax.random.split(jax.random.fold_in(jax.random.key(0), 0), 1)[0]
    plain = Player(fallen, recovery).play(key, 40)
    np.testing.assert_allclose(session.first.qpos, plain.qpos, atol=1e-6)


def test_an_upright_hand_settles_and_the_next_policy_takes_over(
    standing, recovery, crawl
):
    """A hand that stands from the start settles at once, as on the robot."""
    player = RecoveryPlayer(standing, recovery, crawl, (0.1, 0.0, 0.0))
    session = play_episodes(player, 1, 120)
    trace = session.first.trace
    assert trace.extra["settling"].all()
    assert trace.extra["settled"].argmax() == 75
    assert player.behaviours.handed_over
    assert session.held == 0
    np.testing.assert_array_equal(trace.command[:76], 0)
    # The operator has asked all the time; the command still rises from rest.
    speed = trace.command[76:, 0]
    assert 0 < speed[0] < 0.05 and speed[-1] == pytest.approx(0.1)
    text = story(session.first, DT_S, "crawl")
    assert text.startswith("upright after 0.0 s, in the stance after 1.5 s; crawl then")


def test_without_a_next_policy_the_stance_is_held(standing, recovery):
    player = RecoveryPlayer(standing, recovery)
    session = play_episodes(player, 1, 130)
    stance = np.asarray(standing.stance.target_rad)
    np.testing.assert_allclose(player.behaviours.target_rad, stance, atol=1e-6)
    columns = session.table.columns
    assert columns["righted_wrist"][0] == 1
    assert columns["time_to_upright_s"][0] == pytest.approx(0.0)
    assert columns["final_joint_error_rad"][0] < 1e-3


def test_policies_that_cannot_follow_each_other_are_refused(recovery, crawl):
    check_chain(recovery, crawl)
    with pytest.raises(InputError, match="--then: found crawl"):
        check_chain(crawl, crawl)
    with pytest.raises(InputError, match="task: found recovery"):
        check_chain(recovery, recovery)
    interface = crawl.manifest.interface
    turned = dataclasses.replace(interface, v_quat_b=(1.0, 0.0, 0.0, 0.0))
    manifest = dataclasses.replace(crawl.manifest, interface=turned)
    other = dataclasses.replace(crawl, manifest=manifest)
    with pytest.raises(InputError, match="v_quat_b"):
        check_chain(recovery, other)


def test_a_recovery_has_no_command_of_its_own(recovery, capsys):
    args = ["play", str(recovery.source), "--command", "0.1", "0", "0"]
    assert main(args) == 2
    assert "--command" in capsys.readouterr().err


def test_play_and_evaluation_start_from_falls_alone(recovery, setup, monkeypatch):
    made = []

    def refuse(setup, *rest):
        made.append(setup.env)
        raise InputError("seen", "", "", "")

    env = dataclasses.replace(setup.env, practice_fraction=1.0)
    trained = dataclasses.replace(setup, env=env)
    loaded = "fingers_mjx.policy.source.load_bundle_setup"
    monkeypatch.setattr("fingers_mjx.runs.setup.make_env", refuse)
    monkeypatch.setattr(loaded, lambda _: (recovery, trained))
    assert main(["play", str(recovery.source), "--randomize"]) == 2
    assert made[0].practice_fraction == 0.0
    assert as_deployed(trained).env.settle
    assert as_deployed(trained).env.falls == "held_out"
