import warnings

import numpy as np
import pytest
from scipy.stats import ttest_rel

from fingers_mjx.studies.statistics.significance import holm, paired_p

SEED = 11


def test_p_is_that_of_the_paired_t_test():
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    x, y = rng.normal(size=(2, 4, 6))
    np.testing.assert_allclose(paired_p(x - y), ttest_rel(x, y, axis=-1).pvalue)


@pytest.mark.parametrize("values", [[], [1.0], [0.0, 0.0, 0.0], [0.3, 0.3]])
def test_p_is_undefined_without_a_spread(values):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isnan(paired_p(np.array(values)))


def test_holm_gives_the_published_numbers():
    """Four p values whose correction R's p.adjust gives as 0.03, 0.06, 0.06, 0.02."""
    p = np.array([0.01, 0.04, 0.03, 0.005])
    np.testing.assert_allclose(holm(p), [0.03, 0.06, 0.06, 0.02])


def test_holm_of_one_is_itself_and_never_above_one():
    np.testing.assert_array_equal(holm(np.array([0.03])), [0.03])
    np.testing.assert_array_equal(holm(np.array([0.6, 0.7])), [1.0, 1.0])
    assert holm(np.array([])).shape == (0,)


def test_a_comparison_without_p_counts_among_the_others():
    found = holm(np.array([0.01, np.nan, 0.04]))
    np.testing.assert_allclose(found, [0.03, np.nan, 0.08])
    np.testing.assert_allclose(holm(np.array([0.01, 0.04])), [0.02, 0.04])
