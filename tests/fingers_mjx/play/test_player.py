"""The closed loop in C MuJoCo against the environment, world by world."""

import dataclasses

import jax
import mujoco
import numpy as np
import pytest
from support.cli_setup import make_bundle, make_setup, random_weights

from envs.commands import CommandConfig
from fingers_deploy import BundleError, load_bundle
from fingers_mjx.evaluation.setups import nominal, with_command
from fingers_mjx.play.episodes import play_episodes, schedule_of
from fingers_mjx.play.player import Player, varied_model
from fingers_mjx.play.video import frame_steps
from fingers_mjx.runs.setup import make_env

STEPS = 30
KEY = jax.random.key(7)


@pytest.fixture(scope="module")
def setup():
    """Full randomization and noise; a new command every 0.2 s."""
    return make_setup(command=CommandConfig(resample_s=0.2))


@pytest.fixture(scope="module")
def bundle(setup, tmp_path_factory):
    path = tmp_path_factory.mktemp("play") / "bundle"
    return load_bundle(make_bundle(path, setup))


@pytest.fixture(scope="module")
def player(setup, bundle):
    return Player(make_env(setup, 1, "cpu"), bundle)


@pytest.fixture(scope="module")
def in_environment(setup, bundle):
    """The same world stepped by the environment under the same policy."""
    env = make_env(setup, 1, "cpu").env
    step = jax.jit(env.step)
    states = [jax.jit(env.reset)(KEY)]
    for _ in range(STEPS):
        action = bundle.network(np.asarray(states[-1].obs["state"]))
        states.append(step(states[-1], action))
    return jax.device_get(states)


@pytest.fixture(scope="module")
def played(player):
    return player.play(KEY, STEPS)


def test_signals_know_the_targets_as_in_training(player, in_environment):
    """A measure of what lags behind its target needs the one of the step before."""
    episode = player.begin(KEY)
    for state in in_environment[1:4]:
        player.step(episode)
        asked = np.asarray(state.memory.target)
        np.testing.assert_allclose(episode.memory.target, asked, atol=1e-4)
    first = np.asarray(in_environment[0].memory.target)
    assert np.abs(episode.memory.target - first).max() > 1e-2


def test_commands_and_noise_are_those_of_training(played, in_environment):
    commands = np.stack([s.signals.command for s in in_environment[1:]])
    assert len(np.unique(commands, axis=0)) > 2
    np.testing.assert_array_equal(played.trace.command, commands)


def test_motion_is_that_of_the_environment(played, in_environment):
    """Float64 throughout here, float32 between the steps there: alike, not equal."""
    poses = np.stack([s.data.qpos for s in in_environment])
    error = np.abs(played.qpos - poses).max(axis=1)
    moved = np.abs(poses - poses[0]).max()
    assert moved > 0.05
    assert error.max() < 0.02 * moved
    assert error[:5].max() < 1e-5


def test_measured_force_and_tilt_are_those_of_the_environment(played, in_environment):
    for name in ("tip_force_n", "pad_tilt_rad", "vel_v", "power_w"):
        assert getattr(played.trace, name).shape[0] == STEPS
    tilt = np.stack([s.signals.pad_tilt_rad for s in in_environment[1:]])
    np.testing.assert_allclose(played.trace.pad_tilt_rad, tilt, atol=2e-3)


def test_another_world_moves_otherwise(player, in_environment):
    other = player.play(jax.random.key(8), STEPS)
    poses = np.stack([s.data.qpos[7:] for s in in_environment])
    assert np.abs(other.qpos[:, 7:] - poses[: len(other.qpos)]).max() > 0.02


def test_a_varied_model_is_the_one_of_the_world(player):
    env = player.env
    world = jax.jit(env.env.reset)(KEY).memory.world
    model = varied_model(env, world)
    for name, value in env.fields(world).items():
        np.testing.assert_allclose(getattr(model, name), value, rtol=1e-6)
    assert not np.allclose(model.body_ipos, env.mj_model.body_ipos)
    assert not np.allclose(model.geom_friction, env.mj_model.geom_friction)
    # Where the note that frames coincide is kept, C MuJoCo ignores `body_ipos`.
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    palm = env.spec.palm_body
    offset = data.xipos[palm] - data.xpos[palm]
    expected = data.xmat[palm].reshape(3, 3) @ model.body_ipos[palm]
    np.testing.assert_allclose(offset, expected, atol=1e-12)


def test_the_nominal_hand_starts_in_its_stance(setup, bundle):
    calm = nominal(setup)
    env = make_env(with_command(calm, (0.1, 0.0, 0.2)), 1, "cpu")
    one = Player(env, bundle).play(KEY, 2)
    np.testing.assert_allclose(one.qpos[0, 7:], env.stance.joint_pos_rad, atol=1e-6)
    np.testing.assert_allclose(one.trace.command, [[0.1, 0.0, 0.2]] * 2, atol=1e-7)
    world = jax.jit(env.env.reset)(KEY).memory.world
    mu = setup.hand.tip_friction.value
    friction = varied_model(env, world).geom_friction
    np.testing.assert_allclose(friction[list(env.spec.tip_geoms), 0], mu, rtol=1e-6)


def test_a_schedule_shares_the_time_equally():
    commands = [(0.1, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.3)]
    schedule = schedule_of(commands, 7)
    assert schedule.shape == (7, 3)
    counts = [int(np.sum(np.all(schedule == np.float32(c), 1))) for c in commands]
    assert sum(counts) == 7
    assert max(counts) - min(counts) <= 1
    np.testing.assert_array_equal(schedule[0], np.float32(commands[0]))
    np.testing.assert_array_equal(schedule[-1], np.float32(commands[-1]))


def test_a_schedule_replaces_the_commands(player):
    schedule = schedule_of([(0.1, 0.0, 0.0), (0.0, -0.1, 0.2)], 10)
    one = player.play(KEY, 10, schedule)
    np.testing.assert_array_equal(one.trace.command, schedule)


def test_a_fall_ends_the_episode_and_counts(setup, tmp_path):
    """A policy that throws the hand over."""
    weights = random_weights(1, setup.env.action_clip, gain=3.0)
    bundle = load_bundle(make_bundle(tmp_path / "wild", setup, weights))
    session = play_episodes(Player(make_env(setup, 1, "cpu"), bundle), 3, 100)
    survived = session.table.columns["survival"]
    duration = session.table.columns["duration_s"]
    assert survived.shape == (3,)
    assert survived.min() == 0.0
    fell = survived == 0.0
    assert np.all(duration[fell] < 100 * 0.02)
    length = len(session.first.trace.done)
    assert length == len(session.first.qpos) - 1
    if fell[0]:
        assert session.first.trace.done[-1]
        assert duration[0] == pytest.approx((length - 1) * 0.02)


def test_joints_of_another_hand_are_refused(setup, tmp_path):
    from fingers_mjx.policy.interface import interface_of

    env = make_env(setup, 1, "cpu")
    interface = interface_of(env)
    names = interface.joint_names[::-1]
    swapped = dataclasses.replace(interface, joint_names=names)
    bundle = load_bundle(make_bundle(tmp_path / "b", setup, interface=swapped))
    with pytest.raises(BundleError, match=r"joint_names\[0\]"):
        Player(env, bundle)


@pytest.mark.parametrize(
    ("poses", "fps", "expected"),
    [
        (1, 25, [0]),
        (101, 25, list(range(0, 100, 2))),
        (11, 50, list(range(10))),
        (11, 20, [0, 2, 5, 8]),  # 2.5 and 7.5 round to even
    ],
)
def test_frames_are_the_nearest_poses(poses, fps, expected):
    assert frame_steps(poses, 0.02, fps).tolist() == expected
