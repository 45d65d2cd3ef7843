"""A hand with effects in what users run: training, and play in C MuJoCo."""

import dataclasses

import jax
import numpy as np
import pytest
from support import effects_hand as rig
from support.cli_setup import make_bundle, make_setup

from envs.hand.drive.chain import ChainState
from fingers_deploy import load_bundle
from fingers_mjx.play.player import Player
from fingers_mjx.runs.setup import make_env

STEPS = 15
KEY = jax.random.key(7)
EFFECTS = (
    rig.entry("backlash", ("index",), gap_rad=0.03),
    rig.entry("load_friction", drive_share=0.2, load_share=0.2),
    rig.entry("encoder_offset", ("pip",), offset_rad=0.05),
    rig.entry("floor_tilt", roll_rad=0.05, pitch_rad=0.0),
)


@pytest.fixture(scope="module")
def setup():
    return dataclasses.replace(make_setup(), hand=rig.hand_with(*EFFECTS))


@pytest.fixture(scope="module")
def bundle(setup, tmp_path_factory):
    plain = dataclasses.replace(setup, hand=setup.hand.without_effects)
    return load_bundle(make_bundle(tmp_path_factory.mktemp("play") / "bundle", plain))


def test_play_in_c_mujoco_is_the_environment_with_the_effects(setup, bundle):
    env = make_env(setup, 1, "cpu").env
    step = jax.jit(env.step)
    state = jax.jit(env.reset)(KEY)
    poses = [np.asarray(state.data.qpos)]
    for _ in range(STEPS):
        state = step(state, bundle.network(np.asarray(state.obs["state"])))
        poses.append(np.asarray(state.data.qpos))
    played = Player(make_env(setup, 1, "cpu"), bundle).play(KEY, STEPS)
    poses = np.stack(poses)
    moved = np.abs(poses - poses[0]).max()
    error = np.abs(played.qpos - poses).max(axis=1)
    assert moved > 0.05
    assert error.max() < 0.03 * moved
    assert isinstance(state.memory.drive, ChainState)
    calm = dataclasses.replace(setup, hand=setup.hand.without_effects)
    without = Player(make_env(calm, 1, "cpu"), bundle).play(KEY, STEPS)
    assert np.abs(without.qpos - poses).max() > 0.1 * moved
