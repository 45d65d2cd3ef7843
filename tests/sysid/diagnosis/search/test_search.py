"""How candidates are compared: parts of the error, springs, what one link allows."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid.diagnosis.fits.candidate import Model, log_likelihood_gain
from sysid.diagnosis.search.search import _confirmed, _fullest
from sysid.diagnosis.search.selection import explained_gain
from sysid.diagnosis.search.stage import _fits_in
from sysid.least_squares import Fit

PROBLEM: Any = SimpleNamespace(channel_counts=lambda: np.array([1000, 1000]))
"""Two residuals of 1,000 samples."""


def model(score, errors=(1.0, 1.0), noise_cost=0.0):
    nothing = np.zeros(0)
    fit = Fit(nothing, score, nothing, np.zeros((0, 0)), nothing.astype(int), ())
    folds = np.zeros((0, 0))
    return Model((), fit, score, 0.0, folds, np.array(errors), noise_cost)


def test_amplified_noise_gains_nothing():
    spring = model(900.0, noise_cost=60.0)
    assert log_likelihood_gain(model(1000.0), spring, 2000) == pytest.approx(
        50.0 - 60.0
    )
    assert log_likelihood_gain(model(1000.0), model(900.0), 2000) == pytest.approx(50.0)


def test_a_spring_that_drifts_to_less_noise_gains_nothing_by_that():
    noisier, quieter = model(1000.0, noise_cost=80.0), model(900.0, noise_cost=60.0)
    assert log_likelihood_gain(noisier, quieter, 2000) == pytest.approx(50.0)


def test_what_a_cause_must_gain_is_measured_in_its_own_residual():
    """A gain of 35,000 in the controller's residual counts only there."""
    base, limited = model(0.0, (71.0, 2.0)), model(0.0, (1.0, 2.0))
    friction = model(0.0, (1.0, 1.5))
    assert explained_gain(PROBLEM, limited, friction, base) == 0.0
    other = model(0.0, (0.5, 2.0))
    assert explained_gain(PROBLEM, limited, other, base) == pytest.approx(35_000.0)


def test_one_thing_moves_the_link():
    assert not _fits_in("compliance", ("deadband", "backlash"))
    assert not _fits_in("backlash", ("compliance",))
    assert not _fits_in("deadband", ("deadband",))
    assert _fits_in("deadband", ("backlash",))


def test_one_that_explains_what_the_first_does_not_goes_before_it():
    first, full = model(0.0, (4.0, 1.0)), model(0.0, (1.2, 1.0))
    assert _fullest([first, full]) is full
    assert _fullest([first, model(0.0, (3.0, 1.0))]) is first
    assert _fullest([model(0.0, (1.3, 1.0)), full]).errors[0] == 1.3


def test_one_that_may_matter_beside_another_goes_on_if_none_matters_alone():
    """And only then: what matters comes first, though another is better in theory."""
    base, *others = (model(float(n)) for n in range(4))
    wrong, nearer, matters = others

    def said(nearer_ones, matter):
        judge: Any = SimpleNamespace(
            prefers=lambda smaller, larger: any(larger is m for m in nearer_ones),
            confirms=lambda smaller, larger: any(larger is m for m in matter),
        )
        return _confirmed(judge, base, others)

    assert said([nearer, matters], [matters]) is matters
    assert said([nearer, matters], []) is nearer
    assert said([], [wrong]) is None  # a simulation that comes no nearer
