"""Targets between two times of the grid act for their share of a substep."""

import numpy as np
import pytest

from sysid.calibration.held import held_means

STEP_S = 0.5
GRID = np.arange(5) * STEP_S


def test_a_target_counts_from_when_it_is_sent():
    means = held_means(np.array([0.0, 0.6]), np.array([1.0, 3.0]), GRID, STEP_S)
    assert means == pytest.approx([1.0, 1.0, 1.0 + 2.0 * 0.8, 3.0, 3.0])


@pytest.mark.parametrize("late_s", [0.0, 0.1, 0.25, 0.49])
def test_a_delay_within_a_step_is_kept(late_s):
    """∫ (1 − ū) dt of a jump from 0 to 1 grows by just as much as the jump is late."""
    means = held_means(
        np.array([0.0, 0.6 + late_s]), np.array([0.0, 1.0]), GRID, STEP_S
    )
    assert np.sum(1.0 - means) * STEP_S == pytest.approx(0.6 + late_s + STEP_S)


def test_targets_of_one_time_and_beyond_the_grid_do_no_harm():
    t_s, values = np.array([0.2, 0.2, 9.0]), np.array([1.0, 2.0, 5.0])
    means = held_means(t_s, values, GRID, STEP_S)
    assert means == pytest.approx([1.0, 0.4 + 2.0 * 0.6, 2.0, 2.0, 2.0])
