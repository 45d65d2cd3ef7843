"""Updates that are not finite are skipped, counted, and named by their first fault."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.probe_envs import probe

from fingers_mjx.ppo.brax import learning_rate
from fingers_mjx.ppo.config import PpoConfig
from fingers_mjx.ppo.health import (
    finite_terms,
    healthy,
    note_faults,
    record,
    term_names,
)
from fingers_mjx.ppo.rollout import Rollout
from fingers_mjx.ppo.scalars import scalars_of
from fingers_mjx.ppo.state import init_train_state, make_learner
from fingers_mjx.ppo.update import improve, watched_names

T, B = 2, 4
CONFIG = PpoConfig(epochs=1, minibatches=1, actor_layers=(4,), critic_layers=(4,))
SITES = ("none", "loss/policy", "loss/value", "loss/entropy", "kl", "gradient")


ENV = probe("constant", num_envs=B)


@jax.custom_vjp
def with_gain(x, gain):
    """Returns x; what flows back is multiplied by `gain`."""
    return x


with_gain.defvjp(lambda x, gain: (x, gain), lambda gain, up: (up * gain, gain * 0.0))


def fake_loss(params, scalars, normalizer, data, key):
    """A square of the parameters, spoiled at the site that the reward names."""
    site, value = data.reward[0, 0], data.reward[0, 1]

    def at(name, x):
        return jnp.where(site == SITES.index(name), value, x)

    square = sum(jnp.sum(p**2) for p in jax.tree.leaves(params))
    square = with_gain(square, at("gradient", 1.0))
    terms = {
        "policy_loss": at("loss/policy", 0.0),
        "v_loss": at("loss/value", 0.0),
        "entropy_loss": at("loss/entropy", 0.0),
        "kl_mean": at("kl", 1.0),
    }
    return square, terms | {"total_loss": square}


LEARNER = dataclasses.replace(make_learner(ENV, CONFIG), loss=fake_loss)
SCALARS = scalars_of(CONFIG)
IMPROVE = jax.jit(lambda *given: improve(LEARNER, SCALARS, *given))


def rollout(site, value=np.nan):
    steps = jnp.zeros((T, B))
    reward = steps.at[0].set(SITES.index(site)).at[1].set(value)
    obs = {
        "state": steps[..., None] + 1.0,
        "privileged_state": jnp.full((T, B, 2), 2.0),
    }
    action = steps[..., None]
    return Rollout(
        obs=obs,
        last_obs=jnp.zeros((B, 2)),
        action=action,
        log_prob=steps,
        logits=(action, action + 1.0),
        reward=reward,
        done=steps,
        truncation=steps,
        fault=jnp.zeros((T, B), jnp.int32),
    )


def untrained():
    return init_train_state(LEARNER, ENV, jax.random.key(0))


def update(train, site, value=np.nan):
    return IMPROVE(train, rollout(site, value), jax.random.key(1))


def same(one, other):
    pairs = zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True)
    return all(np.array_equal(a, b) for a, b in pairs)


@pytest.mark.parametrize("site", SITES[1:])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_bad_update_is_skipped_and_named(site, value):
    before = untrained()
    after, totals = update(before, site, value)
    assert same(after.params, before.params)
    assert same(after.optimizer, before.optimizer)
    assert int(after.health.skipped) == int(after.health.streak) == 1
    name = watched_names(before.params)[int(after.health.first_term)]
    assert name.startswith(site)
    assert int(after.health.first_iteration) == 0
    assert totals["loss/total"][1] == 0.0  # does not count in the means
    assert all(np.isfinite(x).all() for x in jax.tree.leaves(after))


def test_sound_update_is_made():
    """Negative control: the same update without the fault changes everything."""
    before = untrained()
    after, totals = update(before, "none")
    assert not same(after.params, before.params)
    assert not same(after.optimizer, before.optimizer)
    assert learning_rate(after.optimizer) < learning_rate(before.optimizer)
    assert int(after.health.skipped) == 0
    assert totals["loss/total"][1] == 1.0


def test_bad_parameter_is_named_by_its_path():
    before = untrained()
    policy = before.params.policy
    kernel = policy["params"]["MLP_0"]["hidden_0"]["kernel"]
    policy["params"]["MLP_0"]["hidden_0"]["kernel"] = kernel.at[0].set(np.nan)
    after, _ = update(before, "none")
    name = watched_names(before.params)[int(after.health.first_term)]
    assert name == "params/policy/params/MLP_0/hidden_0/kernel"


def test_streak_ends_with_a_sound_update():
    train = untrained()
    for site in ("kl", "kl", "none", "loss/value"):
        train, _ = update(train, site)
    health = train.health
    counts = (health.skipped, health.streak, health.worst_streak)
    assert [int(x) for x in counts] == [3, 1, 2]
    assert watched_names(train.params)[int(health.first_term)] == "loss/value"
    assert int(health.first_iteration) == 3


def test_observation_too_large_for_the_normalizer_leaves_it_as_it_was():
    before = untrained()
    sound = rollout("none")
    huge = {k: v * 1e30 for k, v in sound.obs.items()}
    after, _ = IMPROVE(before, dataclasses.replace(sound, obs=huge), jax.random.key(1))
    assert same(after.normalizer, before.normalizer)
    after, _ = IMPROVE(before, sound, jax.random.key(1))
    np.testing.assert_allclose(after.normalizer.mean["state"], 1.0)  # control


def test_record_counts_like_a_loop():
    health, streak, worst, skipped = healthy(), 0, 0, 0
    rng = np.random.default_rng(0)
    for iteration in range(50):
        finite = rng.random(3) > 0.2
        health = record(health, jnp.asarray(finite), jnp.int32(iteration))
        streak = 0 if finite.all() else streak + 1
        worst, skipped = max(worst, streak), skipped + (not finite.all())
        found = (int(health.streak), int(health.worst_streak), int(health.skipped))
        assert found == (streak, worst, skipped)


def test_faulty_world_is_noted_until_the_next():
    faults = jnp.zeros((3, 5), jnp.int32)
    health = note_faults(healthy(), faults, jnp.int32(1))
    assert int(health.fault_world) == int(health.fault_iteration) == -1
    health = note_faults(health, faults.at[2, 4].set(2), jnp.int32(2))
    health = note_faults(health, faults, jnp.int32(3))
    found = (health.fault, health.fault_world, health.fault_iteration)
    assert [int(x) for x in found] == [2, 4, 2]


def test_names_and_flags_agree():
    terms = {"params": {"b": jnp.ones(2), "a": jnp.array([np.nan])}, "kl": jnp.ones(())}
    assert term_names(terms) == ["params/a", "params/b", "kl"]
    assert finite_terms(terms).tolist() == [False, True, True]
