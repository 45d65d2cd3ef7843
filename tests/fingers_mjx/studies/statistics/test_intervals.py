import numpy as np
import pytest
from scipy.stats import bootstrap, norm, ttest_1samp

from fingers_mjx.studies.statistics.intervals import (
    RESAMPLES,
    bca_interval,
    expanded,
    interquartile_mean,
    t_interval,
)

VALUES = np.array([0.3, 1.7, -0.4, 2.2, 0.9, 3.1])


def test_t_interval_is_scipys():
    known = ttest_1samp(VALUES, 0.0).confidence_interval(0.95)
    np.testing.assert_allclose(t_interval(VALUES), known)
    narrow = t_interval(VALUES, 0.8)
    assert known[0] < narrow[0] < narrow[1] < known[1]


def test_bca_interval_is_scipys_at_the_expanded_level():
    """Negative control: at the level that is asked for it is much narrower."""
    known, narrow = (
        bootstrap(
            (VALUES,),
            np.mean,
            confidence_level=level,
            n_resamples=RESAMPLES,
            rng=np.random.default_rng(5),
        ).confidence_interval
        for level in (expanded(0.95, len(VALUES)), 0.95)
    )
    width = known.high - known.low
    np.testing.assert_allclose(bca_interval(VALUES), known, atol=0.05 * width)
    assert narrow.high - narrow.low < 0.85 * width


@pytest.mark.parametrize("n", [3, 5, 12, 1000])
def test_expanded_percentiles_of_normal_resamples_are_students_interval(n):
    """Resamples of the mean have the standard deviation s √((n-1)/n) / √n."""
    values = np.random.default_rng(n).normal(size=n)
    spread = values.std() / np.sqrt(n)
    tail = (1 - expanded(0.95, n)) / 2
    ends = values.mean() + spread * norm.ppf([tail, 1 - tail])
    np.testing.assert_allclose(ends, t_interval(values), rtol=1e-6)


def test_expansion_vanishes_with_many_values():
    levels = [expanded(0.95, n) for n in (3, 5, 12, 100, 10**6)]
    assert (np.diff(levels) < 0).all()
    np.testing.assert_allclose(levels[-1], 0.95, atol=1e-5)


def test_no_end_of_a_bootstrap_is_beyond_the_values():
    """Student's interval of three seeds, as the negative control, is far beyond."""
    studies = np.random.default_rng(0).normal(size=(50, 3))
    low, high = bca_interval(studies)
    lowest, highest = studies.min(axis=-1), studies.max(axis=-1)
    assert ((lowest - 1e-12 <= low) & (high <= highest + 1e-12)).all()
    assert (t_interval(studies)[0] < lowest).mean() > 0.9


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
