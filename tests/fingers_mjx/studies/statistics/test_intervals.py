import numpy as np
import pytest
from scipy.stats import bootstrap, ttest_1samp

from fingers_mjx.studies.statistics.intervals import (
    RESAMPLES,
    bca_interval,
    interquartile_mean,
    t_interval,
)

VALUES = np.array([0.3, 1.7, -0.4, 2.2, 0.9, 3.1])


def test_t_interval_is_scipys():
    known = ttest_1samp(VALUES, 0.0).confidence_interval(0.95)
    np.testing.assert_allclose(t_interval(VALUES), known)
    narrow = t_interval(VALUES, 0.8)
    assert known[0] < narrow[0] < narrow[1] < known[1]


def test_bca_interval_is_scipys():
    known = bootstrap(
        (VALUES,), np.mean, n_resamples=RESAMPLES, rng=np.random.default_rng(5)
    ).confidence_interval
    width = known.high - known.low
    np.testing.assert_allclose(bca_interval(VALUES), known, atol=0.05 * width)


def test_intervals_move_and_scale_with_the_values():
    """Negative control: they do not with the values taken to the third power."""
    for interval in (t_interval, bca_interval):
        low, high = interval(VALUES)
        moved = interval(1.0 - 2.0 * VALUES)
        np.testing.assert_allclose(
            moved, (1 - 2 * high, 1 - 2 * low), atol=0.05 * (high - low)
        )
        assert not np.allclose(interval(VALUES**3), (low**3, high**3), rtol=0.05)


def test_many_studies_at_once_are_each_alone():
    studies = np.stack([VALUES, VALUES[::-1] ** 2, -VALUES])
    for interval in (t_interval, bca_interval):
        together = np.transpose(interval(studies))
        alone = [interval(one) for one in studies]
        np.testing.assert_allclose(together, alone)


@pytest.mark.parametrize("count", [0, 1])
def test_below_two_seeds_there_is_no_interval(count):
    values = VALUES[:count]
    assert np.isnan([*t_interval(values), *bca_interval(values)]).all()


def test_two_seeds_have_a_t_interval_alone():
    low, high = t_interval(VALUES[:2])
    np.testing.assert_allclose(high - low, 1.4 * 12.7062, rtol=1e-4)
    assert np.isnan(bca_interval(VALUES[:2])).all()


def test_without_spread_there_is_no_interval():
    values = np.full(5, 0.3)
    assert np.isnan([*t_interval(values), *bca_interval(values)]).all()


def test_interquartile_mean_forgets_the_outer_quarters():
    values = np.array([-100.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 1000.0])
    assert interquartile_mean(values) == 3.5
    assert interquartile_mean(values[[0, 1, 2]]) == values[[0, 1, 2]].mean()
    np.testing.assert_array_equal(
        interquartile_mean(np.tile(values, (2, 1))), [3.5] * 2
    )
