"""Where fits to the angle begin: a servo of which nothing is known still is found."""

import numpy as np
import pytest
from support.plain_servo import KD, KP, problem_with

from sysid.diagnosis.search.candidate import fit_models
from sysid.diagnosis.search.output_error import output_problem
from sysid.diagnosis.search.output_starts import output_starts, settled_output
from sysid.diagnosis.search.search import settled


def scales(problem, theta):
    """Of stiffness and damping, at some coordinates."""
    slots = problem.space.slots
    found = {s.label: float(s.value(u)) for s, u in zip(slots, theta, strict=True)}
    return found["stiffness.scale"], found["damping.scale"]


@pytest.fixture(scope="module")
def unknown():
    """A servo without effort that is believed three times as stiff, and soft."""
    problem = problem_with(believed=(3.0 * KP, 0.4 * KD))
    problem.data.effort[:] = False
    problem, base = settled(problem)
    return output_problem(problem), base


def test_gains_of_which_nothing_is_known_are_found(unknown):
    problem, base = settled_output(*unknown)
    found = scales(problem, base.fit.theta)
    assert found == pytest.approx((1.0 / 3.0, 1.0 / 0.4), rel=0.05)
    assert base.errors[1] < 1.5


def test_a_candidate_begins_where_it_errs_least(unknown):
    problem, base = settled_output(*unknown)
    index = problem.space.of("sensor_latency")[0]
    far = problem.space.nominal.copy()
    far[index] = 0.001 / problem.space.slots[index].scale
    proposed = fit_models(problem, [("sensor_latency",)], [far], rounds=0)
    (start,) = output_starts(problem, base, proposed)
    assert start[index] == far[index]
    others = np.arange(len(start)) != index
    np.testing.assert_array_equal(start[others], base.fit.theta[others])
