"""PPO on probe environments whose answers are known, and its compiled form."""

import dataclasses
import functools
import hashlib
import importlib.util
import re
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brax.training.agents.ppo import networks
from support.probe_envs import Fault, probe

from fingers_mjx.ppo.brax import make_networks
from fingers_mjx.ppo.config import PpoConfig
from fingers_mjx.ppo.iteration import compile_iterations, make_iteration
from fingers_mjx.ppo.members import member_of, stacked
from fingers_mjx.ppo.scalars import scalars_of
from fingers_mjx.ppo.state import init_train_state, make_learner, strong
from fingers_mjx.ppo.totals import means

SMALL = PpoConfig(
    unroll_length=8,
    epochs=4,
    minibatches=2,
    learning_rate=3e-3,
    desired_kl=0.02,
    entropy_cost=0.0,
    init_noise_std=0.5,
    actor_layers=(16,),
    critic_layers=(16,),
    discount=0.9,
)
LEARNER = make_learner(probe("constant"), SMALL)


@functools.cache
def compiled(repeat=1):
    """The iteration is the same function for every probe: it is compiled once."""
    iterate = compile_iterations(make_iteration(probe("constant"), LEARNER), repeat)
    return functools.partial(iterate, stacked([scalars_of(SMALL)]))


@functools.cache
def waiting():
    """The same, with a critic that learns alone for five iterations."""
    config = dataclasses.replace(SMALL, critic_iterations=5)
    iterate = compile_iterations(make_iteration(probe("constant"), LEARNER))
    return functools.partial(iterate, stacked([scalars_of(config)]))


def start(env, seed=0):
    key, key_env, key_nets = jax.random.split(jax.random.key(seed), 3)
    worlds = strong(jax.jit(env.reset)(key_env))
    train = init_train_state(LEARNER, env, key_nets)
    return stacked([train]), worlds, key[None]


def learn(env, iterations, seed=0, iterate=None):
    carry, sums = start(env, seed), []
    for _ in range(iterations):
        *carry, totals = (iterate or compiled())(*carry)
        sums.append(totals)
    totals = {k: sum(np.asarray(t[k][0]) for t in sums) for k in sums[0]}
    return (member_of(carry[0], 0), *carry[1:]), totals


def value_of(train, seen):
    obs = {"privileged_state": jnp.stack([jnp.asarray(seen), jnp.ones(len(seen))], -1)}
    apply = LEARNER.networks.value_network.apply
    return np.asarray(apply(train.normalizer, train.params.value, obs))


def action_of(train, seen):
    obs = {"state": jnp.asarray(seen, jnp.float32)[:, None]}
    apply = LEARNER.networks.policy_network.apply
    return np.asarray(apply(train.normalizer, train.params.policy, obs)[0][:, 0])


def arrays(tree):
    def plain(leaf):
        typed = jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)
        return np.asarray(jax.random.key_data(leaf) if typed else leaf)

    return [plain(leaf) for leaf in jax.tree.leaves(tree)]


def digest(tree):
    return hashlib.sha256(b"".join(x.tobytes() for x in arrays(tree))).hexdigest()


def test_value_of_constant_reward_is_one():
    (train, *_), totals = learn(probe("constant"), 60)
    np.testing.assert_allclose(value_of(train, [0.0]), 1.0, atol=0.05)
    returns, episodes = totals["episode/return"]
    assert returns == episodes == 60 * 64 * 8


def test_value_follows_the_observation():
    (train, *_), _ = learn(probe("seen_value"), 80)
    np.testing.assert_allclose(value_of(train, [-1.0, 1.0]), [-1.0, 1.0], atol=0.1)


def test_value_of_delayed_reward_is_discounted():
    (train, *_), totals = learn(probe("delayed", length=3), 150)
    values = value_of(train, [0.0, 1.0, 2.0])
    np.testing.assert_allclose(values, [0.81, 0.9, 1.0], atol=0.05)
    lengths, episodes = totals["episode/length"]
    assert lengths / episodes == 3.0


def test_truncation_is_not_an_end():
    """Cut by the clock the value stays 1/(1-γ) = 10; ended by a failure it does not."""
    (cut, *_), _ = learn(probe("constant", length=8, truncates=True), 300)
    np.testing.assert_allclose(value_of(cut, [0.0]), 10.0, rtol=0.1)
    (ended, *_), totals = learn(probe("constant", length=8), 300)
    assert value_of(ended, [0.0]) < 7.0
    assert totals["episode/failed"][0] == totals["episode/ended"][0] > 0


def test_best_action_is_found():
    (train, *_), _ = learn(probe("target_action"), 80)
    np.testing.assert_allclose(action_of(train, [0.0]), 0.7, atol=0.1)
    untrained = member_of(start(probe("target_action"))[0], 0)
    assert abs(action_of(untrained, [0.0])[0] - 0.7) > 0.3  # negative control


def test_best_action_follows_the_observation():
    (train, *_), _ = learn(probe("seen_action"), 150)
    np.testing.assert_allclose(action_of(train, [-1.0, 1.0]), [-1.0, 1.0], atol=0.15)


def test_the_critic_learns_alone_at_first():
    untrained = member_of(start(probe("target_action"))[0], 0)
    (train, *_), totals = learn(probe("target_action"), 5, iterate=waiting())
    assert digest(train.params.policy) == digest(untrained.params.policy)
    assert digest(train.params.value) != digest(untrained.params.value)
    rates, updates = totals["learning_rate"]
    assert rates / updates == pytest.approx(SMALL.learning_rate)
    (train, *_), after = learn(probe("target_action"), 6, iterate=waiting())
    assert digest(train.params.policy) != digest(untrained.params.policy)
    first = (after["learning_rate"][0] - rates) / (after["learning_rate"][1] - updates)
    highest = SMALL.learning_rate_min * 1.5**8
    assert SMALL.learning_rate_min <= first <= highest < SMALL.learning_rate


def test_a_policy_that_waited_finds_the_best_action():
    (train, *_), _ = learn(probe("target_action"), 85, iterate=waiting())
    np.testing.assert_allclose(action_of(train, [0.0]), 0.7, atol=0.1)


def test_same_seed_gives_the_same_state_and_another_does_not():
    hashes = [digest(learn(probe("seen_action"), 10, seed=s)[0]) for s in (1, 1, 2)]
    assert hashes[0] == hashes[1] != hashes[2]


def test_repeated_iterations_equal_single_ones():
    (train, *_), sums = learn(probe("seen_action"), 3)
    repeated, *_, totals = compiled(repeat=3)(*start(probe("seen_action")))
    repeated = member_of(repeated, 0)
    for one, other in zip(arrays(train.params), arrays(repeated.params), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-3, atol=1e-5)
    for name, value in totals.items():
        np.testing.assert_allclose(value[0], sums[name], rtol=1e-2, atol=1e-4)


def test_later_calls_do_not_compile():
    carry = compiled()(*start(probe("seen_action")))[:3]
    events = []
    jax.monitoring.register_event_duration_secs_listener(
        lambda name, *_, **__: events.append(name) if "compile" in name else None
    )
    for _ in range(20):
        carry = compiled()(*carry)[:3]
    assert events == []
    jax.jit(lambda x: x * 3.0)(jnp.ones(7))  # negative control: this one compiles
    assert events != []


def test_only_the_adapter_imports_brax():
    package = Path(importlib.util.find_spec("fingers_mjx").origin).parent
    imports = re.compile(r"^\s*(from|import) brax", re.MULTILINE)
    found = [p for p in package.rglob("*.py") if imports.search(p.read_text("utf-8"))]
    assert found == [package / "ppo" / "brax.py"]


@pytest.mark.parametrize("weight", [0.0, 2.0])
def test_means_leave_out_what_has_no_weight(weight):
    totals = np.array([[3.0 * weight, weight], [5.0, 2.0]])
    named = means(["a", "b"], totals)
    assert named == ({"a": 3.0, "b": 2.5} if weight else {"b": 2.5})


@pytest.mark.parametrize("site", ["obs", "privileged", "reward"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_fault_of_one_world_is_set_aside(site, value):
    """The world is counted, the learner stays finite, other worlds are the same."""
    clean = start(probe("seen_action", length=4))
    spoiled = start(probe("seen_action", length=4, fault=Fault(site, value)))
    *clean, clean_totals = compiled()(*clean)
    *spoiled, totals = compiled()(*spoiled)
    # an observation spoils the step that leads to it and the step that starts from it
    assert totals["invalid"][0, 0] == (1 if site == "reward" else 2)
    assert clean_totals["invalid"][0, 0] == 0
    assert all(np.isfinite(x).all() for x in arrays(spoiled[0]))
    for one, other in zip(arrays(clean[1].obs), arrays(spoiled[1].obs), strict=True):
        others = np.arange(64) != 3
        np.testing.assert_array_equal(one[others], other[others])
    count = [np.asarray(s.normalizer.count.lo) for s in (clean[0], spoiled[0])]
    assert count[0] - count[1] == totals["invalid"][0, 0]


def test_world_reported_invalid_does_not_teach():
    """Its steps reach neither the loss, nor the normalizer, nor the metrics."""
    fault = Fault("invalid", 1.0, at=0, until=10**9)
    (train, *_), totals = learn(probe("constant", fault=fault), 60)
    assert totals["invalid"][0] == 60 * 8
    np.testing.assert_allclose(value_of(train, [0.0]), 1.0, atol=0.05)
    assert totals["reward/probe"][1] == 60 * 8 * 63


def test_the_last_layer_of_the_policy_starts_as_small_as_asked():
    """With factor 1 it is the usual start; nothing else changes with it."""
    sizes = {"state": 6, "privileged_state": 7}
    usual = networks.make_ppo_networks(
        sizes,
        2,
        policy_hidden_layer_sizes=(5,),
        distribution_type="normal",
        noise_std_type="log",
        policy_obs_key="state",
        value_obs_key="privileged_state",
    ).policy_network.init(jax.random.key(0))
    config = dataclasses.replace(SMALL, actor_layers=(5,), init_noise_std=1.0)
    found = [
        make_networks(sizes, 2, dataclasses.replace(config, init_mean_scale=scale))
        for scale in (1.0, 0.1)
    ]
    one, tenth = (n.policy_network.init(jax.random.key(0)) for n in found)
    jax.tree.map(np.testing.assert_array_equal, one, usual)
    kernel = one["params"]["Dense_0"].pop("kernel")
    np.testing.assert_allclose(
        tenth["params"]["Dense_0"].pop("kernel"), 0.1 * kernel, rtol=1e-5
    )
    jax.tree.map(np.testing.assert_array_equal, one, tenth)
