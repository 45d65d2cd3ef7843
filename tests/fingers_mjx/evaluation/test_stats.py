import numpy as np
import pytest
from scipy.stats import norm

from envs.errors import InputError
from fingers_mjx.evaluation.stats import (
    bootstrap_interval,
    paired_difference,
    summarize,
)

SEED = 20


def test_mean_spread_and_count_of_known_numbers():
    found = summarize(np.array([1.0, 2.0, 3.0, np.nan, 6.0]))
    assert (found.mean, found.n) == (3.0, 4)
    np.testing.assert_allclose(found.std, np.sqrt(14 / 3))
    assert found.low < 3.0 < found.high
    assert (found.median, found.p95) == (2.5, pytest.approx(5.55))


def test_interval_approaches_the_normal_one():
    print("seed", SEED)
    values = np.random.default_rng(SEED).normal(5.0, 2.0, 2000)
    found = summarize(values)
    half = norm.ppf(0.975) * found.std / np.sqrt(found.n)
    np.testing.assert_allclose(found.low, found.mean - half, atol=0.06 * half)
    np.testing.assert_allclose(found.high, found.mean + half, atol=0.06 * half)


def test_interval_covers_the_truth_as_often_as_it_says():
    """Coverage on skewed data: nominal 0.8, binomial spread 0.033 over 150 trials."""
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    covered = 0
    for trial in range(150):
        low, high = bootstrap_interval(rng.exponential(1.0, 40), 0.8, trial)
        covered += low <= 1.0 <= high
    assert 0.70 <= covered / 150 <= 0.90
    shifted = [bootstrap_interval(rng.exponential(1.5, 40), 0.8, t) for t in range(40)]
    assert np.mean([low <= 1.0 <= high for low, high in shifted]) < 0.5


def test_interval_is_reproducible_and_grows_with_confidence():
    values = np.random.default_rng(SEED).normal(size=30)
    assert summarize(values, seed=3) == summarize(values, seed=3)
    assert summarize(values, seed=3) != summarize(values, seed=4)
    wide, narrow = summarize(values, 0.99), summarize(values, 0.8)
    assert wide.low < narrow.low < narrow.high < wide.high


def test_proportions_get_wilsons_interval():
    found = summarize(np.ones(256))
    z2 = norm.ppf(0.975) ** 2
    np.testing.assert_allclose(found.low, 256 / (256 + z2), rtol=1e-9)
    assert (found.mean, found.std, found.high) == (1.0, 0.0, 1.0)
    half = summarize(np.repeat([0.0, 1.0], 50))
    np.testing.assert_allclose(half.low + half.high, 1.0)
    np.testing.assert_allclose(half.high - 0.5, np.sqrt(z2 / 4 / (100 + z2)), rtol=1e-9)


@pytest.mark.parametrize("values", [[], [np.nan, np.nan]])
def test_nothing_defined_is_not_zero(values):
    found = summarize(np.array(values))
    assert found.n == 0
    assert np.isnan([found.mean, found.std, found.low, found.high]).all()


def test_one_value_has_no_spread_and_equal_values_no_width():
    one = summarize(np.array([0.3]))
    assert (one.mean, one.n) == (0.3, 1)
    assert np.isnan([one.std, one.low, one.high]).all()
    equal = summarize(np.full(5, 0.3))
    assert (equal.low, equal.high) == (0.3, 0.3)


def test_infinity_is_an_error():
    with pytest.raises(InputError, match="infinity"):
        summarize(np.array([1.0, np.inf]))


def test_pairing_removes_what_worlds_have_in_common():
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    level = rng.normal(0.0, 1.0, 12)
    ours = level + 0.3 + 0.05 * rng.normal(size=12)
    paired = paired_difference(ours, level)
    assert 0.2 < paired.low < 0.3 < paired.high < 0.4
    unpaired = paired_difference(ours, rng.permutation(level))  # negative control
    assert unpaired.low < 0.0 < unpaired.high
    swapped = paired_difference(level, ours)
    np.testing.assert_allclose(swapped.mean, -paired.mean)


def test_paired_difference_of_zeros_and_ones_is_not_a_proportion():
    found = paired_difference(np.array([1.0, 1, 1, 0]), np.array([0.0, 0, 1, 0]))
    assert (found.mean, found.n) == (0.5, 4)
    assert found.high <= 1.0


def test_paired_difference_leaves_out_undefined_worlds_and_refuses_other_lengths():
    found = paired_difference(np.array([1.0, np.nan, 3.0]), np.array([0.0, 1.0, 1.0]))
    assert (found.mean, found.n) == (1.5, 2)
    with pytest.raises(InputError, match=r"2 worlds.*3 worlds"):
        paired_difference(np.zeros(3), np.zeros(2))


def test_interval_where_rounding_leaves_bca_undefined():
    values = np.array([1.0, 1.0, np.nextafter(1.0, 2.0)])
    low, high = bootstrap_interval(values)
    assert low <= high
    assert np.isfinite([low, high]).all()
