from types import SimpleNamespace

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from envs.config.settings.push import PushConfig
from envs.errors import InputError
from envs.randomize import no_randomization
from envs.registry import make_env
from envs.rotations import rotate
from envs.tasks.push.camera import CameraConfig
from envs.tasks.push.guide import ARRIVED_M, POCKET_V, TOP_SPEED_MPS, cube_v, guide
from envs.tasks.push.measures import push_measures
from envs.tasks.push.scene import CUBE, POS

CLEAN = CameraConfig(
    latency_steps=(0, 0), dropout=0.0, position_noise_m=0.0, heading_noise_rad=0.0
)


@pytest.fixture(scope="module")
def env():
    return make_env("push", PushConfig(camera=CLEAN, randomize=no_randomization(0.88)))


@pytest.fixture(scope="module")
def starts(env):
    print("seed 20260120")
    keys = jax.random.split(jax.random.key(20260120), 200)
    start = jax.jit(jax.vmap(lambda key: env.task.start(key, env.plant, None)[0]))
    return keys, start(keys)


def test_the_cube_is_the_papers(env):
    model = env.mj_model
    assert model.body(CUBE).mass == pytest.approx(0.0414)
    np.testing.assert_allclose(model.geom(CUBE).size, 0.020)
    assert model.body(CUBE).inertia == pytest.approx(0.0414 * 0.04**2 / 6, rel=1e-6)


def test_nothing_overlaps_at_the_start(env, starts):
    """The cube touches the floor with its four corners and nothing else."""
    model, data = env.mj_model, mujoco.MjData(env.mj_model)
    cube = model.geom(CUBE).id
    for qpos in np.asarray(starts[1].qpos):
        data.qpos[:] = qpos
        mujoco.mj_forward(model, data)
        pairs = [c for c in data.contact[: data.ncon] if cube in (c.geom1, c.geom2)]
        assert len(pairs) == 4
        assert all(c.dist > -1e-4 for c in pairs)
        floor = model.geom("floor").id
        assert all(floor in (c.geom1, c.geom2) for c in pairs)


def test_cube_and_targets_fill_their_ranges(env, starts):
    keys, states = starts
    begun = jax.vmap(lambda k, s: env.task.begin_episode(k, None, s))(keys, states)
    task, pos = begun["task"], np.asarray(states.qpos)[:, POS]
    away = np.linalg.norm(np.asarray(task.target_w) - pos[:, :2], axis=1)
    np.testing.assert_allclose(away, task.distance_m, rtol=1e-4)
    assert 0.10 <= away.min() < 0.12 and 0.38 < away.max() <= 0.40
    root = np.linalg.norm(pos[:, :2] - np.asarray(states.qpos)[:, :2], axis=1)
    assert 0.17 <= root.min() < 0.18 and 0.25 < root.max() <= 0.2601


def test_inputs_of_a_perfect_camera_are_the_scene_in_v(env, starts):
    keys, states = jax.tree.map(lambda x: x[:5], starts)

    level = rotate(jnp.array(env.stance.q_off), jnp.array([0.0, 0.0, -1.0]))
    for key, state in zip(keys, _each(states), strict=True):
        carried = env.task.begin_episode(key, None, state)
        inputs = env.task.inputs(carried, SimpleNamespace(gravity=level))
        seen_v = cube_v(state.qpos, jnp.array(env.stance.q_off))
        np.testing.assert_allclose(inputs["object_pos"][:2], seen_v, atol=1e-6)
        np.testing.assert_array_equal(inputs["object_vel"], 0.0)
        distance = np.linalg.norm(inputs["object_to_target"])
        assert distance == pytest.approx(float(carried["task"].distance_m), rel=1e-4)


def _each(states):
    count = len(states.qpos)
    return [jax.tree.map(lambda x, i=i: x[i], states) for i in range(count)]


def command(object_v, to_target_v):
    return np.asarray(guide(jnp.array(object_v), jnp.array(to_target_v)))


def test_a_cube_in_the_pocket_is_pushed_to_its_target():
    x, y, rate = command(POCKET_V, (0.3, 0.0))
    assert (x, y, rate) == pytest.approx((TOP_SPEED_MPS, 0.0, 0.0), abs=1e-6)
    near = command(POCKET_V, (0.03, 0.0))
    assert 0.02 < near[0] < 0.08


def test_the_guide_stands_at_the_target_and_turns_toward_it_before():
    np.testing.assert_array_equal(command(POCKET_V, (ARRIVED_M / 2, 0.0)), 0.0)
    assert (
        command(POCKET_V, (0.1, 0.1))[2]
        > 0.3
        > -0.3
        > command(POCKET_V, (0.1, -0.1))[2]
    )


def test_a_cube_at_the_side_is_not_run_over():
    """Beside the line of the push, the hand goes across and not ahead."""
    x, y, _ = command((POCKET_V[0] + 0.02, POCKET_V[1] + 0.06), (0.3, 0.0))
    assert y > 0.05 and x < 0.02


def test_guidance_never_exceeds_its_speed():
    print("seed 4")
    rng = np.random.default_rng(4)
    pairs = rng.normal(0, 0.3, (300, 2, 2)).astype(np.float32)
    vel = np.asarray(jax.vmap(lambda p: guide(p[0], p[1]))(pairs))
    assert np.isfinite(vel).all()
    assert np.linalg.norm(vel[:, :2], axis=1).max() <= TOP_SPEED_MPS * 1.0001
    assert np.isfinite(guide(jnp.array(POCKET_V), jnp.zeros(2))).all()


def measured(error_m, alive=None, distance=0.25):
    error = jnp.array(error_m, jnp.float32)
    alive = jnp.ones(len(error), bool) if alive is None else jnp.array(alive)
    distances = jnp.full(len(error), distance)
    found = push_measures(error, distances, alive, 0.02)
    return {k: float(v) for k, v in found.items()}


def test_a_delivery_enters_two_centimetres_and_stays_within_five():
    path = [0.25] * 10 + [0.019] + [0.03] * 49 + [0.011] + [0.3] * 40
    found = measured(path)
    assert found["delivered"] == 1.0 and found["delivered_20_to_30_cm"] == 1.0
    assert np.isnan(found["delivered_to_20_cm"])
    assert found["delivery_time_s"] == pytest.approx(11 * 0.02)
    assert found["final_error_m"] == pytest.approx(0.011)
    assert found["last_error_m"] == pytest.approx(0.3)


@pytest.mark.parametrize(
    "path",
    [
        [0.25] * 10 + [0.021] * 90,  # never inside
        [0.25] * 10 + [0.01] + [0.051] * 89,  # leaves at once
        [0.25] * 60 + [0.01] * 40,  # no second left
    ],
)
def test_other_paths_are_no_delivery(path):
    found = measured(path)
    assert found["delivered"] == 0.0 and np.isnan(found["final_error_m"])


def test_a_second_try_counts_and_a_fall_does_not():
    path = [0.25] * 5 + [0.015] + [0.06] * 5 + [0.015] * 60
    assert measured(path)["delivery_time_s"] == pytest.approx(12 * 0.02)
    alive = [True] * 30 + [False] * 41
    assert measured(path, alive)["delivered"] == 0.0


def test_ranges_out_of_order_are_refused():
    with pytest.raises(InputError, match="target_m"):
        PushConfig(target_m=(0.4, 0.1))
    with pytest.raises(InputError, match="weights"):
        PushConfig(weights={"object_progess": 1.0})
