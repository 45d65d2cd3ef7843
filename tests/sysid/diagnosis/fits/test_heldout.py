"""Parameters without a fold: at the optimum of the others, also along a curve."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import least_squares

from sysid.diagnosis.fits import heldout
from sysid.diagnosis.fits.heldout import held_out
from sysid.least_squares import Task, fit_all

FOLDS = np.repeat([0, 1], [20, 5])
SIZE = np.full(2, 1.0)


def residual(thetas):
    """The product of both coordinates shows in one fold, the first alone in the other.

    Without the other, the first is what the prior says, along a hyperbola.
    """
    a, b = np.asarray(thetas).T
    rng = np.random.default_rng(0)
    noise = rng.normal(size=len(FOLDS))
    both = 30.0 * (a * b - 4.0)[:, None] * np.ones(20)
    first = 30.0 * (a - 1.0)[:, None] * np.ones(5)
    return np.concatenate([both, first], 1) + noise


PROBLEM = SimpleNamespace(
    folds=lambda: FOLDS,
    fold=FOLDS,
    residual=residual,
    space=SimpleNamespace(local=lambda: []),
)
TASK = Task(
    start=np.array([1.0, 4.0]),
    free=np.arange(2),
    center=np.array([2.0, 2.0]),
    deviation=SIZE,
    low=np.full(2, 0.1),
    high=np.full(2, 10.0),
)


def without(fold):
    """The optimum without a fold, by another solver."""

    def both(theta):
        kept = residual(theta[None])[0][fold != FOLDS]
        return np.concatenate([kept, (theta - TASK.center) / TASK.deviation])

    return least_squares(both, TASK.start, xtol=1e-12, ftol=1e-12).x


def predicted():
    fits = fit_all(residual, [TASK], 20)
    return held_out(PROBLEM, [TASK], fits)[0]


def test_each_fold_is_predicted_from_the_optimum_of_the_others():
    found = predicted()
    for fold in (0, 1):
        np.testing.assert_allclose(found.theta[fold], without(fold), atol=0.1)
    seen = np.stack([residual(found.theta[g][None])[0] for g in (0, 1)])
    wanted = sum(np.sum(seen[g][g == FOLDS] ** 2) for g in (0, 1))
    assert found.error == pytest.approx(wanted)


def test_one_step_leaves_the_curve(monkeypatch):
    """Negative control."""
    monkeypatch.setattr(heldout, "STEPS", 1)
    assert np.abs(predicted().theta[1] - without(1)).max() > 0.3


def test_a_free_coordinate_that_no_other_fold_shows_stays():
    """Its prior says nothing, and only the fold that is left out depends on it."""
    shown = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])

    def far(thetas):
        return (np.asarray(thetas) - 3.0) @ shown.T + np.array([0.1, -0.1, 0.0])

    folds = np.array([0, 0, 1])
    problem = SimpleNamespace(
        folds=lambda: folds,
        fold=folds,
        residual=far,
        space=SimpleNamespace(local=lambda: []),
    )
    free = replace(TASK, deviation=np.full(2, np.inf))
    (fit,) = fit_all(far, [free], rounds=10)
    (held,) = held_out(problem, [free], [fit])
    assert held.theta[1] == pytest.approx([3.0, fit.theta[1]], abs=1e-3)


def test_what_meets_a_bound_takes_its_partner_along():
    """Two coordinates that compensate each other, one of which is at its bound."""
    rng = np.random.default_rng(5)
    folds = np.arange(60) % 3
    shown = np.stack([np.ones(60), 1.0 + 0.01 * rng.normal(size=60)], 1)

    def sum_of_both(thetas):
        both = np.asarray(thetas) - np.array([3.0, -1.0])
        return 200.0 * both @ shown.T + rng_noise

    rng_noise = rng.normal(size=60)
    problem = SimpleNamespace(
        folds=lambda: folds,
        fold=folds,
        residual=sum_of_both,
        space=SimpleNamespace(local=lambda: []),
    )
    for high in (2.0, 2.9):  # met by the common optimum, and by folds alone
        task = replace(TASK, low=np.full(2, -9.0), high=np.array([high, 9.0]))
        (fit,) = fit_all(sum_of_both, [task], rounds=20)
        (held,) = held_out(problem, [task], [fit])
        inside = float(fit.residual @ fit.residual)
        assert held.error < 1.5 * inside


def turned(thetas):
    """One coordinate shows by itself, and of another the cosine alone."""
    a, c = np.asarray(thetas).T
    rng = np.random.default_rng(3)
    noise, slant = rng.normal(size=60), 1.0 + 0.05 * rng.normal(size=60)
    other = 100.0 * (np.cos(c) - 1.0)[:, None] * rng.normal(size=60)
    return 300.0 * (a - 1.0)[:, None] * slant + other + noise


def test_what_turns_back_at_the_optimum_goes_no_further_than_it_helps():
    """A slope of nearly nothing there would take it far from the other folds."""
    folds = np.arange(60) % 3
    problem = SimpleNamespace(
        folds=lambda: folds,
        fold=folds,
        residual=turned,
        space=SimpleNamespace(local=lambda: []),
    )
    wide = np.full(2, 5.0)
    task = replace(
        TASK,
        start=np.zeros(2),
        center=np.zeros(2),
        deviation=wide,
        low=-np.full(2, 9.0),
    )
    (fit,) = fit_all(turned, [task], rounds=20)
    (held,) = held_out(problem, [task], [fit])
    assert held.error < 1.1 * float(fit.residual @ fit.residual)
