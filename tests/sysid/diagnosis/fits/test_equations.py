"""Equation errors do not depend on the program that evaluates a candidate."""

import numpy as np
import pytest
from support.plain_servo import problem_with

from sysid.diagnosis.fits.equations import Evaluated, equation_errors

SIZES = ("backlash", "compliance", "sensor_latency", "viscous_friction")


def test_company_changes_no_error():
    """A link that moves and late readings are left out where no candidate has them."""
    problem = problem_with(row_s=0.004)
    rows = np.repeat(problem.space.nominal[None], 1 + len(SIZES), 0)
    for row, effect in zip(rows[1:], SIZES, strict=True):
        row[problem.space.of(effect)[0]] += 0.2

    def errors(thetas):
        return equation_errors(problem.data, problem.space, thetas, Evaluated())

    together = errors(rows)
    alone = np.concatenate([errors(row[None]) for row in rows])
    size = float(np.abs(together).max())
    assert together == pytest.approx(alone, abs=1e-6 * size)
    assert np.abs(together[1:] - together[0]).max((1, 2, 3)).min() > 1e-4 * size
