"""What is said of an arm and of two: numbers, and why there are none."""

import dataclasses
import warnings

import numpy as np
import pytest

from fingers_mjx.studies.statistics.compare import ONE_SEED, arm, difference
from fingers_mjx.studies.statistics.pairs import pair

BASE = {0: 1.0, 1: 2.0, 2: 3.0, 3: 4.0, 4: 5.0}
GAINS = (0.5, 0.4, 0.6, -0.1, 0.0)
OURS = {seed: BASE[seed] + gain for seed, gain in enumerate(GAINS)}
INFERRED = ("low", "high", "bca_low", "bca_high", "p", "detectable")


@pytest.fixture(autouse=True)
def no_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def inferred(found):
    return [getattr(found, name) for name in INFERRED]


def test_a_difference_has_everything_and_pairing_shows_it():
    found = difference(pair(OURS, BASE), "higher")
    assert (found.n, found.dropped, found.note) == (5, 0, "")
    assert found.mean == pytest.approx(np.mean(GAINS))
    assert (found.in_favour, found.against) == (3, 1)
    assert found.low < found.bca_low < found.mean < found.bca_high < found.high
    assert (found.p < 0.05) == (found.low > 0)
    shuffled = dict(zip(BASE, [*OURS.values()][::-1], strict=True))
    unpaired = difference(pair(shuffled, BASE), "higher")  # negative control
    assert unpaired.mean == pytest.approx(found.mean)
    assert unpaired.detectable > 5 * found.detectable


def test_less_is_better_turns_votes_and_chance_around():
    more, less = (difference(pair(OURS, BASE), b) for b in ("higher", "lower"))
    assert (less.in_favour, less.against) == (more.against, more.in_favour)
    assert less.improvement == pytest.approx(1 - more.improvement)
    assert (less.mean, less.p) == (more.mean, more.p)
    neither = difference(pair(OURS, BASE))
    assert (neither.in_favour, neither.improvement) == (None, None)
    assert neither.p == more.p


def test_a_seed_of_one_arm_is_dropped_and_counted():
    found = difference(pair({**OURS, 7: 0.0}, {**BASE, 0: np.nan}))
    assert (found.n, found.dropped) == (4, 2)
    assert found.mean == pytest.approx(np.mean(GAINS[1:]))


def test_one_seed_proves_nothing():
    found = difference(pair({3: 2.0}, {3: 1.0}), "higher")
    assert (found.n, found.mean, found.note) == (1, 1.0, ONE_SEED)
    assert inferred(found) == [None] * len(INFERRED)


def test_no_seed_has_no_numbers():
    found = difference(pair({3: 2.0}, {4: 1.0}), "higher")
    assert (found.n, found.dropped, found.mean) == (0, 2, None)
    assert found.improvement is None
    assert "no seed" in found.note


@pytest.mark.parametrize("gain", [0.0, 0.1])
def test_equal_differences_allow_no_inference(gain):
    """Also where they are equal but for rounding: 0.1 + 0.7 - 0.7 is not 0.1."""
    ours = {seed: value + gain for seed, value in enumerate((0.1, 0.7, 3.3))}
    found = difference(pair(ours, {0: 0.1, 1: 0.7, 2: 3.3}), "higher")
    assert found.mean == pytest.approx(gain)
    assert inferred(found) == [None] * len(INFERRED)
    assert "no spread" in found.note
    moved = difference(pair(ours | {1: ours[1] + 1e-6}, {0: 0.1, 1: 0.7, 2: 3.3}))
    assert None not in inferred(moved)  # negative control


def test_two_seeds_have_all_but_the_bootstrap():
    found = difference(pair({0: 1.0, 1: 3.0}, {0: 0.0, 1: 1.0}), "higher")
    missing = {
        name for name, value in dataclasses.asdict(found).items() if value is None
    }
    assert missing == {"bca_low", "bca_high"}
    assert "two seeds" in found.note


def test_an_arm_alone():
    values = np.array([1.0, 2.0, 3.0, 4.0, np.nan, 40.0])
    found = arm(values)
    assert (found.n, found.mean, found.iqm) == (5, 10.0, 3.0)
    assert found.low < found.mean < found.high
    assert found.iqm_low <= found.iqm <= found.iqm_high
    assert arm(np.array([])).mean is None
    one = arm(np.array([2.0]))
    assert (one.n, one.mean, one.low, one.iqm_low) == (1, 2.0, None, None)
    equal = arm(np.full(4, 0.3))
    assert (equal.mean, equal.low, equal.iqm_high) == (pytest.approx(0.3), None, None)
