"""Fits side by side, against closed forms."""

import numpy as np
import pytest

from sysid.least_squares import Task, fit_all

RNG = np.random.default_rng(3)
A, Y = RNG.normal(size=(40, 3)), RNG.normal(size=40)


def linear(thetas):
    return thetas @ A.T - Y


def task(start, free=(0, 1, 2), deviation=1e6, low=-1e3, high=1e3):
    full = np.full(3, 1.0)
    return Task(
        np.asarray(start, float), np.array(free), 0.0 * full, deviation * full,
        low * full, high * full,
    )  # fmt: skip


def test_least_squares():
    fit = fit_all(linear, [task([0, 0, 0])])[0]
    assert fit.theta == pytest.approx(np.linalg.lstsq(A, Y, rcond=None)[0], abs=1e-4)
    assert fit.jacobian == pytest.approx(A, abs=1e-6)
    assert fit.bounded == ()


def test_prior():
    """With a prior of deviation s: (AᵀA + I/s²) θ = Aᵀ y."""
    fit = fit_all(linear, [task([0, 0, 0], deviation=0.2)])[0]
    exact = np.linalg.solve(A.T @ A + 25.0 * np.eye(3), A.T @ Y)
    assert fit.theta == pytest.approx(exact, abs=1e-4)


def test_fixed_and_bounded():
    plain, held = fit_all(
        linear, [task([0.3, 0.0, 0.0], free=(1, 2)), task([0, 0, 0], high=-0.5, low=-1)]
    )
    assert plain.theta[0] == 0.3
    assert set(held.bounded) == {0, 1, 2}


def test_curved():
    """A rate that enters an exponential, from two starts."""
    t = np.linspace(0.0, 2.0, 50)

    def residual(thetas):
        return thetas[:, :1] * np.exp(-thetas[:, 1:2] * t) - 2.0 * np.exp(-1.5 * t)

    tasks = [task(s, free=(0, 1)) for s in ([1.0, 0.5, 0.0], [3.0, 3.0, 0.0])]
    for fit in fit_all(residual, tasks, rounds=20):
        assert fit.theta[:2] == pytest.approx([2.0, 1.5], abs=1e-2)
