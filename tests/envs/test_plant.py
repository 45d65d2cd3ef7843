import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.config.settings.hand import check_interval
from envs.errors import InputError
from envs.physics.base import PhysicsOutput
from envs.physics.room import ROOM
from envs.registry import make_env
from envs.tasks.crawl import CrawlConfig


class TooSmall:
    """The cpu backend, with Warp's bits for hands that stand beyond x = 0.5 m."""

    def __init__(self, inner, bits):
        self.inner, self.bits = inner, bits
        self.mj_model, self.n_substeps = inner.mj_model, inner.n_substeps

    def step(self, fields, state, ctrl):
        output = self.inner.step(fields, state, ctrl)
        return output.replace(overflow=jnp.where(state.qpos[0] > 0.5, self.bits, 0))


@pytest.mark.parametrize(
    ("bits", "reported"),
    [
        (4, {"contact_overflow"}),  # OverflowType.BROADPHASE
        (8 | 16, {"contact_overflow"}),
        (1, {"constraint_overflow"}),  # OverflowType.NEFC
        (2, {"constraint_overflow"}),
        (1 | 8, {"contact_overflow", "constraint_overflow"}),
    ],
)
def test_dropped_contacts_are_reported_by_the_environment(bits, reported):
    """T9: Warp's overflow bits become metrics of the step, also of an invalid one."""
    env = make_env("crawl")
    physics = TooSmall(env.plant.physics, bits)
    env.plant = dataclasses.replace(env.plant, physics=physics)
    state = jax.vmap(env.reset)(jax.random.split(jax.random.key(0), 4))
    for name in ROOM:
        np.testing.assert_array_equal(state.metrics[name], 0)
    qpos = state.data.qpos.at[:, 0].set(jnp.array([0.0, 1.0, 0.0, 1.0]))
    qvel = state.data.qvel.at[2:].set(jnp.nan)
    state = state.replace(data=state.data.replace(qpos=qpos, qvel=qvel))
    after = jax.jit(jax.vmap(env.step))(state, jnp.zeros((4, 20)))
    for name in ROOM:
        hit = [0, 1, 0, 1] if name in reported else 0
        np.testing.assert_array_equal(after.metrics[name], hit)
    np.testing.assert_array_equal(after.info["invalid"], [0, 0, 1, 1])


def test_room_for_contacts_is_a_setting(monkeypatch):
    given = {}

    def spy(backend, model, substeps, worlds, **options):
        given.update(options, worlds=worlds, substeps=substeps)
        return make_physics(backend, model, substeps, worlds, **options)

    from envs import env as hand_env

    make_physics = hand_env.make_physics
    monkeypatch.setattr(hand_env, "make_physics", spy)
    make_env(
        "crawl",
        CrawlConfig(contacts_per_world=7, constraints_per_world=9),
        num_worlds=5,
    )
    assert given == {
        "contacts_per_world": 7,
        "constraints_per_world": 9,
        "worlds": 5,
        "substeps": 4,
    }


@pytest.fixture(scope="module")
def plant():
    return make_env("crawl").plant


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["qpos", "qvel", "qacc_warmstart", "sensordata"])
def test_a_result_that_is_not_finite_is_replaced_by_the_stance(plant, where, value):
    good = plant.rest.replace(overflow=jnp.int32(4))
    state = good.state
    if where == "sensordata":
        bad = good.replace(sensordata=good.sensordata.at[5].set(value))
    else:
        spoiled = {where: getattr(state, where).at[3].set(value)}
        bad = good.replace(state=state.replace(**spoiled))
    output, invalid = plant.replace_invalid(bad)
    assert invalid and output.overflow == 4
    for x, y in zip(
        jax.tree.leaves(output.replace(overflow=0)),
        jax.tree.leaves(plant.rest.replace(overflow=0)),
        strict=True,
    ):
        np.testing.assert_array_equal(x, y)


def test_a_finite_result_is_left_as_it_is(plant):
    moved = plant.rest.replace(sensordata=plant.rest.sensordata + 1.0)
    output, invalid = plant.replace_invalid(moved)
    assert not invalid and isinstance(output, PhysicsOutput)
    np.testing.assert_array_equal(output.sensordata, moved.sensordata)


@pytest.mark.parametrize("interval", [0.005, 0.02, 0.015, 0.1])
def test_control_intervals_are_whole_physics_steps(interval):
    check_interval(interval)


@pytest.mark.parametrize("interval", [0.0, 0.013, 0.0025, 0.0201, 0.001])
def test_other_intervals_are_refused(interval):
    with pytest.raises(InputError, match="control_dt_s"):
        check_interval(interval)
