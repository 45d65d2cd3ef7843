"""A late target and a late reading, fitted from as late as each other."""

import pytest
from support.plain_servo import problem_with

from sysid.diagnosis.fits.candidate import CONVERGED, fit_models
from sysid.diagnosis.search.lateness import LATE, as_late
from sysid.diagnosis.search.stage import extended

DELAY, LATENCY = LATE
LATE_S = 0.03


@pytest.fixture(scope="module")
def problem():
    return problem_with(late_s=LATE_S)


def fitted(problem, effects, rounds=CONVERGED, late_s=0.0):
    """A model that begins as late by its last effect."""
    theta = problem.space.nominal.copy()
    (index,) = problem.space.of(effects[-1])
    theta[index] = problem.space.slots[index].coordinate(late_s)
    return fit_models(problem, [effects], [theta], rounds=rounds)[0]


@pytest.mark.parametrize(("near", "far"), [(DELAY, LATENCY), (LATENCY, DELAY)])
def test_the_further_one_is_fitted_from_as_late_as_the_nearer_one(problem, near, far):
    right = fitted(problem, (near,), late_s=LATE_S)
    stuck = fitted(problem, (far,), rounds=0, late_s=4.0 * LATE_S)
    (again,) = as_late(problem, [stuck, right])
    assert again.effects == (far,)
    assert again.fit.cost < 0.1 * stuck.fit.cost
    slots, (index,) = problem.space.slots, problem.space.of(far)
    late_s = slots[index].value(again.fit.theta[index])
    assert float(late_s) == pytest.approx(LATE_S, abs=0.01)


def test_one_alone_is_compared_with_nothing(problem):
    delay, other = fitted(problem, (DELAY,), 0), fitted(problem, ("backlash",), 0)
    assert as_late(problem, [delay, other]) == []
    assert as_late(problem, [delay, delay, other]) == []


def test_a_stage_leaves_neither_far_behind(problem):
    smaller = fit_models(problem, [()], [problem.space.nominal])[0]
    costs = {m.effects: m.fit.cost for m in extended(problem, smaller)}
    (delay, latency) = (costs[(name,)] for name in LATE)
    assert delay < 0.1 * smaller.fit.cost
    assert latency == pytest.approx(delay, rel=0.5)
