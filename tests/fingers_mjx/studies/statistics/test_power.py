import numpy as np
import pytest
from scipy.stats import norm

from fingers_mjx.studies.statistics.power import detectable


def test_one_found_in_tables():
    """Twelve pairs detect 0.89 standard deviations with 80 % power (G*Power)."""
    assert detectable(1.0, 12) == pytest.approx(0.889, abs=1e-3)


def test_many_seeds_approach_the_normal_distribution():
    n = 20_000
    known = (norm.ppf(0.975) + norm.ppf(0.8)) / np.sqrt(n)
    assert detectable(1.0, n) == pytest.approx(known, rel=1e-3)


def test_it_scales_with_the_spread_and_shrinks_with_seeds():
    found = [detectable(2.0, n) for n in (2, 3, 5, 12)]
    assert found == sorted(found, reverse=True)
    assert detectable(2.0, 5) == pytest.approx(2 * detectable(1.0, 5))
    assert detectable(1.0, 5, power=0.9) > detectable(1.0, 5)


@pytest.mark.parametrize(("spread", "n"), [(1.0, 1), (0.0, 5), (np.nan, 5)])
def test_without_spread_or_seeds_it_is_unknown(spread, n):
    assert np.isnan(detectable(spread, n))
