"""A new run's networks from the committed crawl policy."""

from dataclasses import replace
from pathlib import Path

import jax
import numpy as np
import pytest

import fingers_mjx
from envs.errors import InputError
from envs.registry import make_batch
from envs.tasks.crawl import CrawlConfig
from fingers_deploy import load_bundle
from fingers_mjx.ppo.brax import update_normalizer
from fingers_mjx.ppo.config import PpoConfig
from fingers_mjx.ppo.state import init_train_state, make_learner, train_template
from fingers_mjx.training.warm_start import COUNT, KNOWN_COUNT, started_from

CRAWL = Path(fingers_mjx.__file__).parent / "policies" / "crawl"
NETWORK = load_bundle(CRAWL).network


def started(env, config=None):
    learner = make_learner(env, config or PpoConfig())
    fresh = init_train_state(learner, env, jax.random.key(0))
    train = started_from(fresh, env, CRAWL)

    def act(obs):
        policy = learner.networks.policy_network
        params = (train.normalizer, train.params.policy)
        padded = {k: np.zeros(n, np.float32) for k, n in env.observation_size.items()}
        return np.asarray(policy.apply(*params, padded | {"state": obs})[0])

    return fresh, train, act


def crawl_action(obs):
    hidden = (obs - NETWORK.mean) / NETWORK.std
    for kernel, bias in NETWORK.layers[:-1]:
        hidden = hidden @ kernel + bias
        hidden = np.where(hidden > 0, hidden, np.expm1(np.minimum(hidden, 0)))
    kernel, bias = NETWORK.layers[-1]
    return hidden @ kernel + bias


def observation(seed):
    noise = np.random.default_rng(seed).normal(size=392)
    return (NETWORK.mean + NETWORK.std * noise).astype(np.float32)


@pytest.fixture(scope="module")
def push():
    return make_batch("push", 1)


def test_the_same_task_goes_on_with_the_same_actor():
    fresh, train, act = started(make_batch("crawl", 1))
    for seed in range(5):
        obs = observation(seed)
        np.testing.assert_allclose(act(obs), crawl_action(obs), atol=2e-4)
    np.testing.assert_array_equal(
        jax.tree.leaves(train.params.value)[0], jax.tree.leaves(fresh.params.value)[0]
    )


@pytest.mark.parametrize(("count", "changed"), [(KNOWN_COUNT, False), (COUNT, True)])
def test_what_many_worlds_see_first_does_not_change_a_known_policy(count, changed):
    """All worlds begin alike; counted like the policy's own past they made it fall."""
    env = make_batch("crawl", 1)
    _, train, _ = started(env)
    before = train.normalizer
    assert int(before.count) == KNOWN_COUNT
    number = type(before.count)(hi=0, lo=count)
    ratio = count / KNOWN_COUNT
    variance = jax.tree.map(lambda x: x * ratio, before.summed_variance)
    after = before.replace(count=number, summed_variance=variance)
    sizes = env.observation_size.items()
    first = {k: np.zeros((1, 16_384, n), np.float32) for k, n in sizes}
    valid = np.ones((1, 16_384), bool)
    for _ in range(24):
        after = update_normalizer(after, first, valid)
    moved = np.abs(after.mean["state"] - before.mean["state"]) / before.std["state"]
    assert (moved.max() > 0.5) == changed
    assert (moved.max() < 0.1) == (not changed)


def test_another_scale_asks_for_the_same_small_motion():
    _, _, act = started(make_batch("crawl", 1, CrawlConfig(action_scale_rad=0.03)))
    obs = observation(1)
    doubled = obs.copy()
    doubled[208:368] *= 2  # the previous outputs, too, are twice as large
    np.testing.assert_allclose(act(doubled), 2 * crawl_action(obs), atol=1e-3)


def test_another_task_walks_as_under_the_mean_command(push):
    _, train, act = started(push)
    walk = observation(2)
    walk[368:] = NETWORK.mean[368:]
    gain = 0.060 / 0.040
    obs = np.zeros(440, np.float32)
    obs[:368] = walk[:368]
    obs[208:368] *= gain
    wanted = gain * crawl_action(walk)
    for value in (0.0, 0.3):  # what it did not know has no influence yet
        obs[368:] = value
        np.testing.assert_allclose(act(obs), wanted, atol=1e-3)
    for name, size in push.observation_size.items():
        assert train.normalizer.mean[name].shape == (size,)
        variance = train.normalizer.summed_variance[name] / COUNT
        np.testing.assert_allclose(
            np.sqrt(variance), train.normalizer.std[name], rtol=1e-5
        )
        assert (np.asarray(variance) > 0).all()


def test_shapes_alone_suffice_for_the_check(push):
    assert started_from(train_template(push, PpoConfig()), push, CRAWL)


def test_other_layers_are_refused(push):
    small = replace(PpoConfig(), actor_layers=(64, 32))
    with pytest.raises(InputError, match="layers"):
        started_from(train_template(push, small), push, CRAWL)
