"""Fits side by side, against closed forms."""

import dataclasses

import numpy as np
import pytest

from sysid.least_squares import Task, fit_all, standard_errors

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


def test_a_start_beyond_a_bound_is_where_the_fit_begins():
    """Its cost is that of the bound; the error of beyond could not be reached."""
    begun = np.linalg.lstsq(A, Y, rcond=None)[0]
    (fit,) = fit_all(linear, [task(begun, high=begun - 0.1)], rounds=10)
    residual = linear(fit.theta[None])[0]
    np.testing.assert_array_equal(fit.residual, residual)
    assert np.all(fit.theta <= begun - 0.1)


def test_coordinates_that_compensate_each_other_stay_in_their_valley():
    """One meets its bound in the first step, and the other goes as far as that lets."""
    shown = np.array([[1.0, 1.0], [1.0, 1.001], [1.0, 0.999]])

    def both(thetas):
        return 1e3 * (np.asarray(thetas) - np.array([3.0, -1.0])) @ shown.T

    start = Task(np.array([0.5, 1.0]), np.arange(2), np.zeros(2), np.full(2, 1e3),
                 np.full(2, -9.0), np.array([1.0, 9.0]))  # fmt: skip
    (fit,) = fit_all(both, [start], rounds=3)
    assert fit.theta == pytest.approx([1.0, 1.0], abs=5e-3)


def test_curved():
    """A rate that enters an exponential, from two starts."""
    t = np.linspace(0.0, 2.0, 50)

    def residual(thetas):
        return thetas[:, :1] * np.exp(-thetas[:, 1:2] * t) - 2.0 * np.exp(-1.5 * t)

    tasks = [task(s, free=(0, 1)) for s in ([1.0, 0.5, 0.0], [3.0, 3.0, 0.0])]
    for fit in fit_all(residual, tasks, rounds=20):
        assert fit.theta[:2] == pytest.approx([2.0, 1.5], abs=1e-2)


def test_differences_are_short_where_much_follows_from_little():
    """Of a swing whose rate is off the phase grows: (d/dx) sin(t x) is t cos(t x).

    A hundredth turns it by up to four, and is not the way to the three thousandths
    that are searched.
    """
    t = np.linspace(0.0, 400.0, 200)

    def residual(thetas):
        return 20.0 * (np.sin(t * (1.0 + thetas[:, :1])) - np.sin(1.003 * t))

    (fit,) = fit_all(residual, [task([0, 0, 0], free=(0,))], rounds=10)
    assert fit.theta[0] == pytest.approx(0.003, abs=1e-5)
    exact = 20.0 * t * np.cos(1.003 * t)
    assert fit.jacobian[:, 0] == pytest.approx(exact, abs=0.1 * np.abs(exact).max())


def test_a_coordinate_that_diverges_at_once_lets_the_others_move():
    """Beside it one that moves nothing made the normal equations singular."""

    def residual(thetas):
        gone = np.where(thetas[:, :1] > 0.0, np.inf, 0.0)
        with np.errstate(invalid="ignore"):
            return gone + thetas[:, 2:] * A[:, 2] - Y

    (fit,) = fit_all(residual, [task([0, 0, 0], deviation=np.inf)], rounds=10)
    assert fit.theta[0] == 0.0
    assert fit.theta[2] == pytest.approx(A[:, 2] @ Y / (A[:, 2] @ A[:, 2]), abs=1e-4)


def test_central_differences_are_exact_for_a_parabola():
    """Forward differences of t² at 0 with step h are h; central ones are 0."""

    def residual(thetas):
        return thetas[:, :1] ** 2 + 0.0 * A[:, 0]

    plain = task([0, 0, 0], free=(0,))
    both = [plain, dataclasses.replace(plain, central=True)]
    forward, central = fit_all(residual, both, rounds=0)
    assert forward.jacobian[0, 0] == pytest.approx(1e-2)
    assert central.jacobian[0, 0] == 0.0


def test_blocks_of_one_residual_give_the_usual_errors_of_white_noise():
    rng = np.random.default_rng(8)
    j = rng.normal(size=(4000, 3))
    noise = rng.normal(size=4000)
    plain = fit_all(lambda thetas: thetas @ j.T - noise, [task([0, 0, 0])])[0]
    usual = np.sqrt(np.diag(np.linalg.inv(j.T @ j)))
    errors, wide = standard_errors(plain, np.full(3, 1e6), np.arange(4000))
    assert errors == pytest.approx(usual, rel=0.1)
    assert wide == pytest.approx(1.96, abs=0.01)


def test_repeated_residuals_do_not_count_twice():
    """Each of 400 residuals stands there nine times; a block holds the nine."""
    rng = np.random.default_rng(9)
    j, noise = rng.normal(size=(400, 3)), rng.normal(size=400)
    single = fit_all(lambda x: x @ j.T - noise, [task([0, 0, 0])])[0]
    often = np.repeat(j, 9, 0), np.repeat(noise, 9)
    nine = fit_all(lambda x: x @ often[0].T - often[1], [task([0, 0, 0])])[0]
    prior = np.full(3, 1e6)
    alone, _ = standard_errors(single, prior, np.arange(400))
    blocks, _ = standard_errors(nine, prior, np.repeat(np.arange(400), 9))
    assert blocks == pytest.approx(alone, rel=1e-3)


def test_what_the_data_do_not_show_has_no_error():
    def residual(thetas):
        return thetas @ (A * [1.0, 1.0, 1e-3]).T - Y

    fit = fit_all(residual, [task([0, 0, 0], deviation=2.0)])[0]
    errors, _ = standard_errors(fit, np.full(3, 2.0), np.arange(40))
    assert np.isnan(errors).tolist() == [False, False, True]


def test_a_fit_that_does_not_move_keeps_its_jacobian():
    """Its start is the optimum: slopes are found once, and no step helps."""
    asked = []

    def counted(thetas):
        asked.append(len(thetas))
        return linear(thetas)

    best = np.linalg.lstsq(A, Y, rcond=None)[0]
    fit = fit_all(counted, [task(best)], 4)[0]
    assert fit.theta == pytest.approx(best)
    assert asked.count(3) == 1 and fit.jacobian == pytest.approx(A, abs=1e-6)
