"""Bodies that a task adds to the hand."""

import copy
import dataclasses

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from envs.commands import CommandConfig
from envs.env import HandEnv
from envs.errors import InputError
from envs.hand.hand_file import load_hand_file
from envs.hand.model import build_spec
from envs.hand.nominal import vendor_hand
from envs.hand.spec import hand_spec
from envs.hand.stance import load_stance
from envs.scene import build_scene
from envs.tasks.crawl import Crawl, CrawlConfig

HAND_NQ, HAND_NV = 27, 26
HAND, Q_OFF = load_hand_file(), load_stance().q_off


def add_toys(spec):
    """A loose brick and a key on a slide, both far from the hand."""
    brick = spec.worldbody.add_body(name="brick", pos=[1, 0, 0.03])
    brick.add_freejoint(name="brick")
    brick.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.01, 0.02, 0.03], conaffinity=3
    )
    key = spec.worldbody.add_body(name="key", pos=[-1, 0, 0.1])
    key.add_joint(name="key", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1])
    key.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0], contype=0, conaffinity=0
    )


@dataclasses.dataclass(frozen=True)
class CrawlAmongToys(Crawl):
    def add_scene(self, spec):
        add_toys(spec)

    def vary_scene(self, plant, fields, world):
        heavy = fields["body_mass"].at[plant.mj_model.body("brick").id].multiply(3.0)
        return fields | {"body_mass": heavy}

    def scene_signals(self, plant, carried, signals, output):
        return {"brick_pos_w": output.state.qpos[HAND_NQ : HAND_NQ + 3]}


def still():
    zero = (0.0, 0.0)
    return CrawlConfig(command=CommandConfig(zero, zero, zero), episode_s=0.4)


@pytest.fixture(scope="module")
def env():
    return HandEnv(CrawlAmongToys(still()))


@pytest.fixture(scope="module")
def rollout(env):
    step, state = jax.jit(env.step), jax.jit(env.reset)(jax.random.key(2))
    states = [state]
    for _ in range(10):
        states.append(step(states[-1], jnp.full(20, 0.1)))
    return states


def test_the_hand_moves_as_if_they_were_not_there(rollout):
    bare = HandEnv(Crawl(still()))
    step, state = jax.jit(bare.step), jax.jit(bare.reset)(jax.random.key(2))
    for among in rollout[1:]:
        state = step(state, jnp.full(20, 0.1))
        qpos, qvel = among.data.qpos[:HAND_NQ], among.data.qvel[:HAND_NV]
        np.testing.assert_allclose(qpos, state.data.qpos, atol=1e-6)
        np.testing.assert_allclose(qvel, state.data.qvel, atol=1e-4)
        np.testing.assert_allclose(among.reward, state.reward, atol=1e-5)
        np.testing.assert_allclose(among.obs["state"], state.obs["state"], atol=1e-4)


def test_the_task_reads_its_own_bodies(env, rollout):
    assert rollout[0].data.qpos.shape == (27 + 7 + 1,)
    brick = rollout[-1].signals.extra["brick_pos_w"]
    np.testing.assert_allclose(brick, [1.0, 0.0, 0.03], atol=1e-3)
    assert rollout[-1].data.qpos[-1] < -0.1  # the key falls freely


def test_loose_bodies_keep_their_physics():
    """The turned inertial frame is another way to write the same body."""
    plain = build_spec(HAND, np.array(Q_OFF))
    add_toys(plain)
    models = plain.compile(), build_scene(HAND, Q_OFF, add_toys).compile()
    assert models[0].dof_simplenum.any() and not models[1].dof_simplenum.any()
    for seed in range(3):
        moved = []
        for model in models:
            data = mujoco.MjData(model)
            data.qpos[:HAND_NQ], data.qpos[HAND_NQ + 2] = load_stance().qpos, 1.0
            data.qvel[HAND_NV:] = np.random.default_rng(seed).normal(0, 3, 7)
            mujoco.mj_step(model, data, 20)
            moved.append(data.qpos.copy())
        np.testing.assert_allclose(moved[0], moved[1], atol=1e-9)


def test_their_mass_counts_where_it_is_given_per_world():
    model = build_scene(HAND, Q_OFF, add_toys).compile()
    heavy = copy.copy(model)
    heavy.body_mass[model.body("brick").id] *= 3
    speed = []
    for one in (model, heavy):
        data = mujoco.MjData(one)
        data.xfrc_applied[model.body("brick").id, 0] = 5.0
        data.qpos[HAND_NQ + 2] = 1.0
        mujoco.mj_step(one, data, 2)
        speed.append(data.qvel[HAND_NV])
    assert speed[0] == pytest.approx(3 * speed[1], rel=1e-3)


def test_bodies_before_the_hand_are_refused():
    spec = mujoco.MjSpec()
    add_toys(spec)
    palm = spec.worldbody.add_body(name="palm")
    palm.add_freejoint(name="root")
    palm.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0])
    for name in vendor_hand().joint_names:
        palm = palm.add_body(name=f"{name}_link")
        palm.add_joint(name=name)
        palm.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0])
    model = spec.compile()
    with pytest.raises(InputError, match="the hand first"):
        hand_spec(model)
