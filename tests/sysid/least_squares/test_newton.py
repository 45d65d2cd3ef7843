"""Steps with and without bounds, against closed forms and another solver."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from sysid.least_squares.newton import bounded_step, gauss_newton, normal_equations

RNG = np.random.default_rng(3)
A, Y = RNG.normal(size=(40, 3)), RNG.normal(size=40)
FREE = np.full(3, np.inf)


def test_a_full_step_solves_a_linear_problem():
    prior = np.full(3, 1e6)
    step = gauss_newton(A, -Y, np.zeros(3), prior)
    assert step == pytest.approx(np.linalg.lstsq(A, Y, rcond=None)[0], abs=1e-6)
    assert np.all(np.abs(gauss_newton(A, -Y, np.zeros(3), prior, 1e9)) < 1e-6)


def test_without_bounds_it_is_the_step_of_newton():
    equations = normal_equations(A, -Y, np.zeros(3), FREE)
    step = bounded_step(*equations, -FREE, FREE)
    assert step == pytest.approx(gauss_newton(A, -Y, np.zeros(3), FREE))


@pytest.mark.parametrize("alike", [0.0, 3.0])
def test_with_bounds_it_is_the_best_within_them(alike):
    """Of coordinates that do not, and that nearly do the same; a cut step is worse."""
    shown = A + alike * RNG.normal(size=(40, 1))
    low, high = np.array([-0.05, -9.0, 0.0]), np.array([0.02, 9.0, 9.0])
    wanted = shown @ np.array([0.5, -1.0, 0.7])
    equations = normal_equations(shown, -wanted, np.zeros(3), FREE)
    step = bounded_step(*equations, low, high)
    best = lsq_linear(shown, wanted, (low, high)).x
    assert step == pytest.approx(best, abs=1e-6)
    cut = np.clip(gauss_newton(shown, -wanted, np.zeros(3), FREE), low, high)
    left = [float(np.sum((shown @ x - wanted) ** 2)) for x in (step, cut)]
    assert left[0] < 0.95 * left[1]


def test_coordinates_that_passed_their_bounds_together_leave_them_again():
    """Twelve that nearly do four things: of those that first pass, few stay there."""
    rng = np.random.default_rng(5)
    shown = rng.normal(size=(60, 4)) @ rng.normal(size=(4, 12))
    shown += 0.1 * rng.normal(size=shown.shape)
    wanted, high = rng.normal(size=60), rng.uniform(0.01, 0.3, 12)
    low = np.append(0.0, -high[1:])  # the first already stands at its bound
    equations = normal_equations(shown, -wanted, np.zeros(12), np.full(12, 1e3))
    step = bounded_step(*equations, low, high)
    best = lsq_linear(shown, wanted, (low, high), method="bvls", tol=1e-13).x
    assert step == pytest.approx(best, abs=1e-5)
    assert 0.0 < np.mean((step > low) & (step < high)) < 1.0


def test_a_coordinate_that_shows_nowhere_stays():
    shown = np.array([[1.0, 0.0], [1.0, 0.0]])
    equations = normal_equations(shown, np.ones(2), np.zeros(2), np.full(2, np.inf))
    step = bounded_step(*equations, np.full(2, -9.0), np.full(2, 9.0))
    assert step == pytest.approx([-1.0, 0.0])
