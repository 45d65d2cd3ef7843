"""Several policies evaluated side by side are what each is alone."""

from pathlib import Path
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from support.cli_setup import make_setup

from fingers_mjx.evaluation.source import evaluate_source
from fingers_mjx.evaluation.together import evaluate_together
from fingers_mjx.policy.source import PolicySource
from fingers_mjx.runs.setup import make_env, overridden


def policy(setup, seed):
    """A policy with two layers of random weights."""
    env, rng = make_env(setup, 1, "cpu"), np.random.default_rng(seed)
    inputs, actions = env.observation_size["state"], env.action_size
    sizes = ((inputs, 16), (16, actions))
    layers = [
        (rng.normal(0, 0.1, size).astype(np.float32), np.zeros(size[1], np.float32))
        for size in sizes
    ]
    network = SimpleNamespace(
        mean=np.zeros(inputs, np.float32),
        std=np.ones(inputs, np.float32),
        layers=tuple(layers),
    )
    return PolicySource(Path(f"runs/{seed}"), setup, network, 0)


@pytest.fixture(scope="module")
def sources():
    setup = overridden(make_setup(), ["env.episode_s=0.4"])
    return [policy(setup, seed) for seed in (1, 2)]


@pytest.fixture(scope="module")
def together(sources):
    return evaluate_together(sources, 3, seed=5)


@pytest.mark.parametrize("number", [0, 1])
def test_to_the_last_bit_each_has_the_episodes_that_it_has_alone(
    sources, together, number
):
    alone = evaluate_source(sources[number], 3, seed=5)
    found = together[number]
    assert found.dt_s == alone.dt_s
    for name, column in alone.columns.items():
        np.testing.assert_array_equal(found.columns[name], column, err_msg=name)
    jax.tree.map(np.testing.assert_array_equal, found.traces, alone.traces)
    assert len(np.unique(alone.worlds["world/tip_friction"])) == 3
    jax.tree.map(np.testing.assert_array_equal, found.worlds, alone.worlds)


def test_each_policy_acts_in_its_own_worlds(together):
    one, two = (table.traces.joint_pos for table in together)
    np.testing.assert_array_equal(one.shape, two.shape)
    assert np.abs(one[-1] - two[-1]).max() > 1e-3
