"""The shim on the robot and the environment in training: the same inputs and targets.

Both see the same states; the shim only through what a robot would measure.
"""

import jax
import numpy as np
import pytest
from support.cli_setup import make_bundle, make_setup, random_weights
from support.shim import differences, driven, measured

from envs.commands import CommandConfig
from envs.randomize import no_randomization
from fingers_deploy import ActionTransform, PolicyController, load_bundle
from fingers_mjx.runs.setup import make_env

STEPS = 40
TOLERANCE = 1e-6
CLIP = 1.0


@pytest.fixture(scope="module")
def setup():
    """No noise; starts off the stance; a new command every 0.2 s."""
    return make_setup(
        action_clip=CLIP,
        randomize=no_randomization(0.88),
        command=CommandConfig(resample_s=0.2),
    )


@pytest.fixture(scope="module")
def bundle(setup, tmp_path_factory):
    path = tmp_path_factory.mktemp("parity") / "bundle"
    # Strong enough to reach the clip of the action and the limits of joints.
    return load_bundle(make_bundle(path, setup, random_weights(gain=3.0)))


@pytest.fixture(scope="module")
def world(setup):
    env = make_env(setup, 1, "cpu").env
    return jax.jit(env.reset), jax.jit(env.step)


@pytest.fixture(scope="module", params=["onnxruntime", "numpy"])
def rollout(request, world, bundle):
    """States of one world that the shim drives, one more than actions."""
    states = driven(world, bundle, request.param, STEPS)
    return request.param, states


def test_shim_equals_environment(bundle, rollout):
    found = differences(bundle, *rollout)
    assert found["observation"] <= TOLERANCE
    assert found["action"] <= 1e-5
    assert found["target"] <= TOLERANCE


def test_the_rollout_exercises_what_could_differ(rollout):
    states = rollout[1]
    actions = np.stack([s.memory.action for s in states[1:]])
    commands = {tuple(s.memory.command.tolist()) for s in states}
    tilts = np.stack([s.obs["state"][160:163] for s in states])
    assert np.mean(np.abs(actions) == CLIP) > 0.05
    assert np.mean(np.std(actions, axis=0) > 0.01) > 0.5
    assert len(commands) >= 4
    assert np.ptp(tilts, axis=0).max() > 0.02


def test_targets_are_equal_for_any_action(bundle, world):
    """Also beyond the clip and at the joint limits, which a policy may not reach."""
    reset, step = world
    transform = ActionTransform(bundle.manifest.interface)
    start = reset(jax.random.key(1))
    limits = np.array(bundle.manifest.interface.joint_limits_rad, np.float32)
    rng = np.random.default_rng(2)
    targets = [limits[:, 0], limits[:, 1], np.array(start.memory.target)]
    for target in targets:
        action = rng.normal(0, 2, 20).astype(np.float32)
        state = start.replace(memory=start.memory.replace(target=target))
        ours = transform.step(target, action)
        assert np.abs(ours - step(state, action).memory.target).max() <= TOLERANCE
        assert np.abs(ours - transform.step(target, 2 * action)).max() > 1e-3


def swap_joints(measured):
    joints = np.array(measured["joint_pos"])
    joints[[4, 8]] = joints[[8, 4]]
    return measured | {"joint_pos": joints}


def flip_gravity(measured):
    return measured | {"gravity_b": -measured["gravity_b"]}


def world_angvel(measured):
    return measured | {"angvel_b": measured["angvel_b"][::-1]}


def degrees(measured):
    return measured | {"joint_pos": np.degrees(measured["joint_pos"])}


WRONG = [swap_joints, flip_gravity, world_angvel, degrees]


@pytest.mark.parametrize("wrong", WRONG, ids=lambda f: f.__name__)
def test_wrong_measurement_is_found(bundle, rollout, wrong):
    found = differences(bundle, *rollout, wrong)
    assert found["observation"] > 1e-2
    assert found["target"] > 1e-3


def test_wrong_order_in_time_is_found(bundle, rollout):
    runtime, states = rollout
    controller = PolicyController(bundle, runtime)
    for state in states[:20]:
        controller.step(**measured(state))
    ours, joints = controller.observation, states[19].obs["state"][:160].reshape(8, 20)
    assert np.abs(ours[:160] - joints.ravel()).max() <= TOLERANCE
    assert np.abs(ours[:160] - joints[::-1].ravel()).max() > 1e-3
    assert np.abs(ours[:160] - joints.T.ravel()).max() > 1e-2
