"""Parameters without a setting or a load: the optimum of the others, not beside it."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from scipy.optimize import least_squares, minimize_scalar

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.fits.heldout import held_out
from sysid.diagnosis.fits.parameters import Slot, Space
from sysid.diagnosis.fits.refolded import refolded
from sysid.least_squares import Task, fit_all

FOLDS = np.repeat([0, 1], 20)
LOADS = np.concatenate([np.linspace(0.1, 0.6, 20), np.linspace(1.0, 3.0, 20)])
SLOTS = [
    Slot("", name, "1", "linear", 1.0, 2.0, 0.1, 10.0, 1.0, (), False)
    for name in ("most", "rate")
]


def errors(theta):
    """What is left of 3 tanh 2 x, and of a ripple that the model lacks."""
    most, rate = theta
    measured = 3.0 * np.tanh(2.0 * LOADS) + 0.1 * np.sin(40.0 * LOADS)
    return measured - most * np.tanh(rate * LOADS)


@dataclass(frozen=True)
class Curve:
    """The part of a problem that fits need; a fold is a range of loads."""

    noise: float = 0.01
    whole: bool = True
    repeat: bool = True
    valid: np.ndarray = field(default_factory=lambda: np.ones(40, bool))
    fold: np.ndarray = field(default_factory=lambda: FOLDS)
    space: Space = field(default_factory=lambda: Space(tuple(SLOTS)))
    time_step_s: float = 0.0

    def raw(self, thetas):
        return np.where(self.valid, [errors(theta) for theta in thetas], 0.0)

    def residual(self, thetas):
        return self.raw(thetas) / self.noise

    def folds(self):
        return self.fold

    def with_remaining(self, raw):
        return replace(self, noise=float(np.sqrt(np.mean(raw**2))))


def fitted(problem):
    """The common optimum, and where steps with its slopes end."""
    sizes = np.ones(2)
    task = Task(sizes, np.arange(2), 2.0 * sizes, sizes, 0.1 * sizes, 10.0 * sizes)
    fit = fit_all(problem.residual, [task], 30)[0]
    held = held_out(problem, [task], [fit])[0]
    penalty = float(np.sum((fit.theta - 2.0) ** 2))
    parts = held.error, penalty, held.theta, np.ones(2), 0.0
    return Model((), fit, *parts)


def without(fold, noise):
    """The optimum without a fold, by another solver."""

    def both(theta):
        return np.concatenate([errors(theta)[fold != FOLDS] / noise, theta - 2.0])

    return least_squares(both, [3.0, 2.0], xtol=1e-12, ftol=1e-12).x


def test_each_fold_is_predicted_from_the_optimum_of_the_others():
    problem = Curve()
    steps = fitted(problem)
    found = refolded(problem, steps)
    wanted = np.stack([without(g, problem.noise) for g in (0, 1)])
    np.testing.assert_allclose(found.fold_theta, wanted, atol=1e-3)
    assert np.abs(steps.fold_theta - wanted).max() > 0.03  # negative control
    seen = [problem.residual(found.fold_theta[g][None])[0] for g in (0, 1)]
    error = sum(np.sum(seen[g][g == FOLDS] ** 2) for g in (0, 1))
    assert found.score == pytest.approx(error + np.sum((found.fit.theta - 2.0) ** 2))


def test_without_repeats_the_error_of_the_model_counts_as_noise():
    problem = Curve(repeat=False)
    model = fitted(problem)
    left = problem.with_remaining(problem.raw(model.fit.theta[None])[0])
    assert left.noise > 3.0 * problem.noise
    wanted = np.stack([without(g, left.noise) for g in (0, 1)])
    found = refolded(problem, model).fold_theta
    np.testing.assert_allclose(found, wanted, atol=1e-3)
    assert np.abs(found - refolded(Curve(), model).fold_theta).max() > 0.02


def test_what_belongs_to_a_record_stays(monkeypatch):
    problem, model = Curve(), fitted(Curve())
    monkeypatch.setattr(Space, "local", lambda space: [0])
    found = refolded(problem, model).fold_theta
    most = model.fit.theta[0]
    np.testing.assert_array_equal(found[:, 0], most)
    for fold in (0, 1):

        def cost(rate, kept=fold != FOLDS):
            left = errors((most, rate))[kept] / problem.noise
            return float(np.sum(left**2)) + (rate - 2.0) ** 2

        wanted = minimize_scalar(cost, bounds=(1.0, 3.0), method="bounded").x
        assert found[fold, 1] == pytest.approx(wanted, abs=1e-3)


def test_folds_of_time_are_as_they_were():
    problem = Curve(whole=False)
    model = fitted(problem)
    assert refolded(problem, model) is model
