"""The noise of the equations' residuals."""

import numpy as np
import pytest
from support.plain_servo import problem_with

from sysid.diagnosis.search.settling import settled


def test_what_a_model_leaves_is_noise_and_by_how_much_it_is_more_stays_known():
    problem, _ = settled(problem_with())
    known = np.array([noise.deviation for noise in problem.noise])
    rng = np.random.default_rng(0)
    left = rng.normal(size=problem.valid.shape) * known[:, None, None]
    more = problem.with_remaining(5.0 * left)
    grown = np.array([noise.deviation for noise in more.noise]) / known
    assert grown == pytest.approx(5.0, rel=0.3)
    assert more.inflated == pytest.approx(grown**2)
    # Less than what was measured is no noise.
    assert problem.with_remaining(0.1 * left).inflated == (1.0, 1.0)
