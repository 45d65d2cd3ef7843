"""The last seconds of what is plotted."""

import numpy as np

from fingers_mjx.play.viewer.history import History


def test_what_is_older_than_the_window_goes():
    history = History(2, window_s=1.0)
    for step in range(31):
        history.add(0.1 * step, np.array([step, -step]))
    times, first, second = history.columns()
    np.testing.assert_allclose(times[[0, -1]], [2.0, 3.0])
    np.testing.assert_array_equal(first, -second)
    np.testing.assert_array_equal(first, np.arange(20, 31))


def test_a_new_episode_begins_anew():
    history = History(1)
    history.add(5.0, np.array([1.0]))
    history.add(0.02, np.array([2.0]))
    np.testing.assert_array_equal(history.columns()[0], [0.02])


def test_before_any_row_there_is_something_to_draw():
    assert [len(column) for column in History(3).columns()] == [1, 1, 1, 1]
