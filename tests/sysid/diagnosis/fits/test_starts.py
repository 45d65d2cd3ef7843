"""From where fits of an effect begin, on an error that is written down here."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid.diagnosis.fits.starts import best_starts, valleys

GAPS = (0.001, 0.003, 0.01, 0.03, 0.07, 0.2, 0.4)
"""Play that is tried [rad]."""


def start_gaps(costs, count=1):
    """Gaps from which play begins whose errors at `GAPS` are these; 10 without it."""
    at = dict(zip((0.0, *GAPS), (10.0, *costs), strict=True))
    space = SimpleNamespace(
        of=lambda effect: [0],
        starts=lambda effect: [{0: gap} for gap in GAPS],
        slots=[SimpleNamespace(many_optima=False)],
        prior_sds=lambda effects: np.array([np.inf, 1.0]),
        nominal=np.zeros(2),
    )

    def residual(thetas):
        return np.sqrt([[at[gap], 0.0] for gap in thetas[:, 0]])

    fit = SimpleNamespace(free=np.array([1]), jacobian=np.array([[0.0], [1.0]]))
    problem = SimpleNamespace(space=space, residual=residual)
    model = SimpleNamespace(effects=(), fit=fit)
    found = best_starts(problem, model, np.zeros(2), ["backlash"], count)
    return [theta[0] for theta in found["backlash"]]


@pytest.mark.parametrize(
    ("costs", "expected"),
    [
        ((11.0, 12.0, 20.0, 60.0, 25.0, 80.0, 99.0), [0.001, 0.07]),
        ((11.0, 12.0, 20.0, 60.0, 70.0, 80.0, 99.0), [0.001]),
        ((11.0, 9.0, 20.0, 60.0, 70.0, 80.0, 99.0), [0.003]),
        ((11.0, 9.0, 20.0, 18.0, 25.0, 17.0, 99.0), [0.003, 0.2]),
    ],
)
def test_a_valley_behind_a_hill_is_begun_from_too(costs, expected):
    """Play that a joint crosses freely, and play that it hardly notices."""
    assert start_gaps(costs) == expected


def test_a_valley_that_is_among_the_best_is_no_other():
    assert start_gaps((11.0, 9.0, 20.0, 60.0, 70.0, 80.0, 99.0), 2) == [0.003, 0.001]


def test_the_ends_are_no_valleys():
    assert valleys([1.0, 2.0, 0.5]) == []
    assert valleys([2.0, 1.0, 1.0]) == []
