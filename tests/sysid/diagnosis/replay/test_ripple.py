"""A servo without a low-pass jumps with its targets, and so does its logged effort."""

import numpy as np
import pytest
from support.plain_servo import problem_with


@pytest.mark.parametrize(("shown", "lacks"), [(0.0, 1.0), (0.5, 0.0), (1.0, -1.0)])
def test_law_and_motion_agree_on_how_much_of_a_jump_an_effort_shows(shown, lacks):
    """Just before the target of its row, as a mean, or just behind that target."""
    problem = problem_with(row_s=0.01, shown=shown)
    thetas = np.stack([problem.space.nominal] * 3)
    (ripple,) = (i for i, s in enumerate(problem.space.slots) if s.label == "ripple")
    thetas[:, ripple] = shares = np.array([-1.0, 0.0, 1.0])
    errors = np.sqrt(np.mean(problem.raw(thetas)[:, :, 30:-30] ** 2, (2, 3)))
    right = shares == lacks
    assert errors[right].max() < 0.03
    assert errors[~right].min() > 0.2
