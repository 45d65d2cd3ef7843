import numpy as np

from fingers_mjx.studies.statistics.pairs import pair


def test_a_seed_counts_where_both_arms_define_it():
    found = pair({3: 1.0, 1: 4.0, 2: np.nan, 5: 2.0}, {1: 1.5, 3: 0.5, 2: 9.0, 4: 0.0})
    assert found.seeds == (1, 3)
    assert found.dropped == (2, 4, 5)
    np.testing.assert_array_equal(found.difference, [2.5, 0.5])


def test_infinity_is_as_good_as_missing():
    assert pair({0: np.inf, 1: 1.0}, {0: 1.0, 1: 1.0}).dropped == (0,)
    assert pair({}, {0: 1.0}).dropped == (0,)
