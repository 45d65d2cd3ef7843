"""Grids and random samples of settings."""

import math

import numpy as np
import pytest

from envs.config.typed import from_dict
from envs.errors import InputError
from fingers_mjx.studies.sweep.search import (
    MAX_CONFIGURATIONS,
    Search,
    gridded,
    sampled,
)

SPACE = {
    "ppo.entropy_cost": {"low": 1e-4, "high": 1e-1, "log": True},
    "ppo.clip": {"low": 0.1, "high": 0.3},
    "ppo.epochs": [3, 5, 8],
}


def search(**changes):
    return from_dict(Search, {"space": SPACE} | changes, "spec.yaml")


def test_samples_lie_in_their_ranges_and_are_spread_as_asked():
    found = list(sampled(search(samples=2000)).values())
    cost = np.array([one["ppo.entropy_cost"] for one in found])
    clip = np.array([one["ppo.clip"] for one in found])
    assert cost.min() >= 1e-4 and cost.max() <= 1e-1
    # A quarter of the samples lies in each quarter of the (logarithmic) range.
    quarters = np.histogram(np.log10(cost), np.linspace(-4, -1, 5))[0]
    assert np.all(np.abs(quarters - 500) < 5 * math.sqrt(500))
    quarters = np.histogram(clip, np.linspace(0.1, 0.3, 5))[0]
    assert np.all(np.abs(quarters - 500) < 5 * math.sqrt(500))
    assert {one["ppo.epochs"] for one in found} == {3, 5, 8}


def test_more_samples_keep_those_before_and_another_seed_gives_others():
    few, many = sampled(search(samples=3)), sampled(search(samples=9))
    assert list(few) == ["sample-00", "sample-01", "sample-02"]
    assert few == {name: many[name] for name in few}
    assert sampled(search(samples=3, seed=1)) != few


def test_a_grid_is_every_combination_once():
    found = gridded({"a": (1, 2), "b": ("x", "y", "z")})
    assert list(found) == [f"grid-{n:02d}" for n in range(6)]
    assert found["grid-01"] == {"a": 1, "b": "y"}
    assert len({tuple(one.items()) for one in found.values()}) == 6


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"space": {"x": {"low": 2.0, "high": 1.0}}}, "space.x.high"),
        ({"space": {"x": {"low": 0.0, "high": 1.0, "log": True}}}, "space.x.low"),
        ({"space": {"x": []}}, "space.x"),
        ({"space": {"x": {"lo": 0.0, "high": 1.0}}}, "space.x.lo"),
        ({"space": {}}, "space"),
        ({"samples": 0}, "samples"),
        ({"sample": 3}, "sample"),
    ],
)
def test_a_search_that_cannot_be_is_refused_by_name(change, field):
    with pytest.raises(InputError) as error:
        search(**change)
    assert error.value.field == field


def test_a_grid_too_large_is_refused():
    with pytest.raises(InputError, match="combinations"):
        gridded({"a": tuple(range(100)), "b": tuple(range(100))})
    assert MAX_CONFIGURATIONS < 100 * 100
    with pytest.raises(InputError, match="0 combinations"):
        gridded({"a": ()})
