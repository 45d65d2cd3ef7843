"""The whole environment on two backends: the same rollout, compared in every part."""

from functools import cache

import jax
import numpy as np
import pytest

from envs.registry import make_batch

WORLDS, STEPS, SEED = 2, 12, 20260117

# float32 carries 6e-8 of relative error; a contact, whose time constant is 0.02 s, and
# twelve control steps of a stiff servo raise it to some 1e-6 in positions. The bounds
# leave a factor of fifty, and stay far below what a tenth of the friction changes.
BOUNDS = {
    "data.qpos": 5e-5,
    "data.qvel": 5e-3,
    "obs.state": 5e-3,
    "obs.privileged_state": 2e-2,
    "reward": 5e-5,
    "tip_force_n": 2e-2,
    "tip_shear_n": 2e-2,
    "torque_nm": 2e-3,
    "tip_pos_v": 5e-5,
    "tip_vel_v": 5e-3,
    "link_contact": 0,
    "palm_contact": 0,
    "done": 0,
}


def rollout(backend, change=lambda state: state):
    """One record of every compared part per step."""
    rng = np.random.default_rng(SEED)
    step, state, records = compiled(backend), change(first()), []
    for _ in range(STEPS):
        action = rng.normal(0, 0.6, (WORLDS, 20)).astype(np.float32)
        state = step(state, action)
        signals = vars(state.signals)
        parts = {
            "data.qpos": state.data.qpos,
            "data.qvel": state.data.qvel,
            "obs.state": state.obs["state"],
            "obs.privileged_state": state.obs["privileged_state"],
            "reward": state.reward,
            "done": state.done,
        }
        parts |= {name: signals[name] for name in BOUNDS if name in signals}
        records.append(jax.device_get(parts))
    return {name: np.stack([r[name] for r in records]) for name in BOUNDS}


@cache
def compiled(backend):
    batch = make_batch("crawl", WORLDS, backend=backend, auto_reset=False)
    return jax.jit(batch.step)


@cache
def first():
    """The first state, which does not depend on the backend."""
    print(f"seed {SEED}")
    return jax.jit(make_batch("crawl", WORLDS).reset)(jax.random.key(SEED))


def beyond(a, b):
    """Names of the parts that differ by more than their bound."""
    worst = {name: np.abs(a[name] - b[name]).max() for name in BOUNDS}
    return {name: worst[name] for name in BOUNDS if not worst[name] <= BOUNDS[name]}


def smoother(state):
    """Nine tenths of the friction of every tip."""
    world = state.memory.world
    friction = 0.9 * world.variation.tip_friction
    world = world.replace(variation=world.variation.replace(tip_friction=friction))
    return state.replace(memory=state.memory.replace(world=world))


@pytest.fixture(scope="module")
def on_cpu():
    return rollout("cpu")


def test_jax_and_cpu_are_the_same_environment(on_cpu):
    assert beyond(rollout("jax"), on_cpu) == {}
    # It shows what it should: tips that carry, and tips in the air.
    carried = on_cpu["tip_force_n"] > 0.15
    assert carried.any() and not carried.all()


def test_the_comparison_notices_a_tenth_of_the_friction(on_cpu):
    """Negative control."""
    parts = beyond(rollout("cpu", smoother), on_cpu)
    assert {"data.qpos", "data.qvel", "obs.state", "reward", "tip_force_n"} <= set(
        parts
    )


@pytest.mark.gpu
def test_warp_and_cpu_are_the_same_environment(on_cpu):
    assert beyond(rollout("warp"), on_cpu) == {}
