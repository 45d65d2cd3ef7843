import jax
import numpy as np
import pytest

from envs.registry import make_env
from envs.signals import tilt
from envs.tasks.upright import near_stance


@pytest.fixture(scope="module")
def plant():
    return make_env("crawl").plant


def many(plant, joint_rad=0.05, speed_mps=0.05):
    print("seed 20260114")
    keys = jax.random.split(jax.random.key(20260114), 500)
    return jax.vmap(lambda key: near_stance(key, plant, joint_rad, speed_mps))(keys)


def test_starts_are_the_stance_but_for_heading_noise_and_speed(plant):
    states, rest = many(plant), plant.rest.state
    np.testing.assert_array_equal(states.qpos[:, :3], np.tile(rest.qpos[:3], (500, 1)))
    offset = np.asarray(states.qpos[:, 7:] - rest.qpos[7:])
    assert np.abs(offset).max() <= 0.05 + 1e-6 and np.abs(offset).max() > 0.049
    speed = np.asarray(states.qvel)
    assert np.abs(speed[:, :3]).max() <= 0.05 and np.abs(speed[:, :3]).max() > 0.049
    assert not speed[:, 3:].any() and not np.asarray(states.qacc_warmstart).any()


def test_every_heading_is_level_in_v(plant):
    states = many(plant)
    q_off = np.array(plant.stance.q_off)
    v_quat = jax.vmap(lambda quat: _product(quat, q_off))(states.qpos[:, 3:7])
    assert np.abs(np.asarray(jax.vmap(tilt)(v_quat))).max() < 1e-3
    heading = 2 * np.arctan2(v_quat[:, 3], v_quat[:, 0])
    quadrants = np.histogram(np.mod(heading, 2 * np.pi), 4, (0, 2 * np.pi))[0]
    assert (quadrants > 80).all()  # 125 on average, five deviations of 9.7 below


def test_joints_stay_in_their_range(plant):
    wide = np.asarray(many(plant, joint_rad=3.0).qpos[:, 7:])
    low, high = np.asarray(plant.joint_range).T
    assert (wide >= low).all() and (wide <= high).all()
    assert (wide == low).any() and (wide == high).any()


def test_without_noise_it_is_the_stance_itself(plant):
    states = many(plant, 0.0, 0.0)
    expected = np.tile(plant.rest.state.qpos[7:], (500, 1))
    np.testing.assert_array_equal(states.qpos[:, 7:], expected)
    assert not np.asarray(states.qvel).any()


def _product(a, b):
    w = a[0] * b[0] - a[1:] @ b[1:]
    xyz = a[0] * b[1:] + b[0] * a[1:] + jax.numpy.cross(a[1:], b[1:])
    return jax.numpy.append(w, xyz)
