import numpy as np
from scipy.stats import mannwhitneyu

from fingers_mjx.studies.statistics.improvement import probability_of_improvement

SEED = 7


def test_it_is_one_above_zero_below_and_a_half_when_equal():
    low, high = np.array([1.0, 2.0]), np.array([3.0, 4.0, 5.0])
    assert probability_of_improvement(high, low) == 1.0
    assert probability_of_improvement(low, high) == 0.0
    assert probability_of_improvement(low, low) == 0.5


def test_it_is_the_statistic_of_mann_and_whitney():
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    x, y = rng.integers(0, 5, 9).astype(float), rng.integers(0, 5, 7).astype(float)
    known = mannwhitneyu(x, y).statistic / (len(x) * len(y))
    np.testing.assert_allclose(probability_of_improvement(x, y), known)
    np.testing.assert_allclose(probability_of_improvement(y, x), 1 - known)


def test_of_nothing_it_is_unknown():
    assert np.isnan(probability_of_improvement(np.array([]), np.array([1.0])))
