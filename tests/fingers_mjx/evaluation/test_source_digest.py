"""A summary says which policy, to the bit, and on what it was measured."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from fingers_mjx.evaluation.source import summary
from fingers_mjx.policy.digest import digest
from fingers_mjx.policy.source import load_source

CRAWL = "fingers_mjx/policies/crawl"


@pytest.fixture(scope="module")
def source(request):
    return load_source(request.config.rootpath / CRAWL)


def test_a_summary_names_the_policy_and_the_machine(source):
    found = summary(source, {"survival": np.ones(4)}, seed=0)
    assert found["policy_sha256"] == digest(source.network)
    assert "cores" in found["machine"] and jax.devices()[0].device_kind in str(found)


def test_one_bit_makes_another_policy(source):
    kernel, bias = source.network.layers[-1]
    other = np.array(bias, np.float32)
    other[0] = np.nextafter(other[0], np.inf)
    layers = (*source.network.layers[:-1], (kernel, other))
    changed = replace(source.network, layers=layers)
    assert digest(changed) != digest(source.network)
