"""A policy that is shown its command times a gain."""

from dataclasses import replace

import numpy as np
import pytest

from envs.errors import InputError
from fingers_deploy import load_bundle
from fingers_mjx.policy.command_gain import with_command_gain

GAIN = (1.25, 0.5, 1.0)


@pytest.fixture(scope="module")
def bundle():
    return load_bundle("fingers_mjx/policies/crawl_steering")


@pytest.fixture
def obs(bundle):
    """One observation whose commands are those of eight control steps."""
    network = bundle.network
    noise = np.random.default_rng(3).standard_normal(len(network.mean))
    return (network.mean + network.std * noise).astype(np.float32)


def shown(obs, gain):
    """The observation with its commands, the last terms, times the gain."""
    seen = obs.copy()
    seen[-24:] *= np.tile(np.float32(gain), 8)
    return seen


def test_it_acts_as_if_it_were_commanded_more(bundle, obs):
    network = bundle.network
    gained = with_command_gain(network, bundle.manifest.interface, GAIN)

    np.testing.assert_allclose(gained(obs), network(shown(obs, GAIN)), atol=2e-5)
    assert np.abs(gained(obs) - network(obs)).max() > 1e-2


def test_what_is_no_command_is_seen_as_before(bundle):
    network = bundle.network
    gained = with_command_gain(network, bundle.manifest.interface, GAIN)

    np.testing.assert_array_equal(gained.mean[:-24], network.mean[:-24])
    np.testing.assert_array_equal(gained.std[:-24], network.std[:-24])


def test_a_gain_of_one_changes_no_bit(bundle, obs):
    network = bundle.network
    gained = with_command_gain(network, bundle.manifest.interface, (1.0, 1.0, 1.0))

    np.testing.assert_array_equal(gained(obs), network(obs))


@pytest.mark.parametrize("gain", [(1.0, 1.0), (1.0, 1.0, 1.0, 1.0)])
def test_a_gain_of_another_size_is_refused(bundle, gain):
    with pytest.raises(InputError, match=f"command of {len(gain)} entries"):
        with_command_gain(bundle.network, bundle.manifest.interface, gain)


def test_a_policy_without_a_command_is_refused(bundle):
    interface = bundle.manifest.interface
    terms = tuple(t for t in interface.observation.terms if t.name != "command")
    observation = replace(interface.observation, terms=terms)

    with pytest.raises(InputError, match=r"joint_pos \(20\)"):
        with_command_gain(
            bundle.network, replace(interface, observation=observation), GAIN
        )
