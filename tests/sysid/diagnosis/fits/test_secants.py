"""How far fits go towards their starts, on residuals that are written down here."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid.diagnosis.fits.secants import along_secants

START = 10.0
"""Size at which an effect begins that is somewhere between 0 and that."""


def went(residual, nuisance=(0.0, 0.0, 0.0)):
    """Where the fit of one effect begins.

    Args:
        residual: of the effect's size.
        nuisance: slope of the residual by a parameter that follows, without a prior.
    """
    space = SimpleNamespace(
        prior_sds=lambda effects: np.array([np.inf, 1e9]), nominal=np.zeros(2)
    )
    jacobian = np.array(nuisance)[:, None]
    fit = SimpleNamespace(free=np.array([1]), jacobian=jacobian, theta=np.zeros(2))
    problem: Any = SimpleNamespace(
        space=space,
        residual=lambda thetas: np.stack([residual(size) for size, _ in thetas]),
    )
    model: Any = SimpleNamespace(effects=(), fit=fit)
    return along_secants(problem, model, np.array([[START, 0.0]]))[0, 0]


def test_a_start_has_the_size_that_a_linear_error_says():
    size = went(lambda size: np.array([1.0 - 2.0 * size, 0.0, 3.0]))
    assert size == pytest.approx(0.5)


def test_nuisance_parameters_take_up_their_part_first():
    """Of two errors one goes with a gain: the effect is as large as the other says."""

    def both(size):
        return np.array([1.0 - 2.0 * size, 5.0 - 2.0 * size, 0.0])

    assert went(both) == pytest.approx(1.5)
    assert went(both, nuisance=(0.0, 1.0, 0.0)) == pytest.approx(0.5)


@pytest.mark.parametrize(
    "residual",
    [
        pytest.param(lambda size: np.array([1.0 + size, 0.0, 0.0]), id="farther"),
        pytest.param(lambda size: np.array([1.0, 0.0, 0.0]), id="idle"),
        pytest.param(
            lambda size: np.array([1.0, np.nan if size else 0.0, 0.0]), id="not finite"
        ),
    ],
)
def test_what_comes_no_nearer_stays(residual):
    assert went(residual) == 0.0


def test_a_start_that_diverges_leads_next_to_nowhere():
    """A simulation that diverges has a finite, huge error."""
    assert 0.0 < went(lambda size: np.array([1.0, 0.0, 0.0]) - 1e6 * size) < 1e-5


def test_no_start_goes_beyond_itself():
    """The size at which it was simulated is the farthest that is known."""
    assert went(lambda size: np.array([100.0 - size, 0.0, 0.0])) == START
