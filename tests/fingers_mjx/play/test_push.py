"""Pushing in C MuJoCo through the shim's tracker against the environment."""

import dataclasses

import jax
import numpy as np
import pytest
from support.cli_setup import TRAIN, make_bundle, random_weights

from fingers_deploy import load_bundle
from fingers_mjx.evaluation.setups import with_command
from fingers_mjx.play.episodes import play_episodes
from fingers_mjx.play.player import Player
from fingers_mjx.runs.setup import make_env, new_setup
from fingers_robot.behaviour.tracking import ObjectTracker

STEPS = 25
KEY = jax.random.key(3)
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def setup():
    return new_setup(dataclasses.replace(TRAIN, task="push"), None)


@pytest.fixture(scope="module")
def player(setup, tmp_path_factory):
    weights = random_weights(clip=setup.env.action_clip, inputs=440)
    path = make_bundle(tmp_path_factory.mktemp("push") / "bundle", setup, weights)
    return Player(make_env(setup, 1, "cpu"), load_bundle(path))


def test_play_sees_and_does_what_the_environment_does(player):
    env = player.env.env
    step, state = jax.jit(env.step), jax.jit(env.reset)(KEY)
    network = player.controller.bundle.network
    poses, lags = [np.asarray(state.data.qpos)], []
    for _ in range(STEPS):
        observation = np.asarray(state.obs["state"])
        state = step(state, network(observation))
        poses.append(np.asarray(state.data.qpos))
        lags.append(np.asarray(state.signals.extra["joint_lag_rad"]))
    played = player.play(KEY, STEPS)
    assert played.held == 0
    np.testing.assert_allclose(played.qpos, np.stack(poses), atol=2e-3)
    lag = played.trace.extra["joint_lag_rad"]
    np.testing.assert_allclose(lag, np.stack(lags), atol=2e-3)
    assert lag[1:].max() > 0.02
    shown = np.asarray(player.controller.observation)
    inputs = slice(368, 440)
    np.testing.assert_allclose(shown[inputs], observation[inputs], atol=2e-3)
    assert np.ptp(shown[inputs]) > 0.1


def test_another_velocity_estimate_would_be_seen(player, monkeypatch):
    """Negative control: the tracker that runs is the shim's."""
    asked = []
    original = ObjectTracker.inputs

    def spy(self, gravity_b):
        asked.append(original(self, gravity_b))
        return asked[-1]

    monkeypatch.setattr(ObjectTracker, "inputs", spy)
    player.play(KEY, 3)
    assert len(asked) == 3 and asked[0].shape == (9,)


def test_deliveries_are_measured(player):
    table = play_episodes(player, 2, STEPS).table
    assert set(table.columns["delivered"]) <= {0.0, 1.0}
    assert (table.columns["target_distance_m"] >= 0.1).all()


def test_there_is_no_command_to_give(setup):
    with pytest.raises(ValueError, match="--command"):
        with_command(setup, (0.1, 0.0, 0.0))
