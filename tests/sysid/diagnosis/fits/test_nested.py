"""A smaller model leaves its valley where a larger one has, and only there."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from sysid.diagnosis.fits import nested
from sysid.diagnosis.fits.candidate import fit_models
from sysid.diagnosis.fits.nested import nearer_without
from sysid.diagnosis.fits.parameters import NUISANCE, Slot, Space

SLOTS = (
    Slot(NUISANCE, "delay", "1", "linear", 1.0, 0.0, -3.0, 3.0, 100.0, (), False),
    Slot("play", "gap", "1", "linear", 1.0, 0.0, -3.0, 3.0, 0.0, (), True),
)


@dataclass(frozen=True)
class Valleys:
    """Two valleys of the delay, at −1 and, deeper, at 1; and a gap.

    The gap is measured as `gap`, in units of a hundredth.
    """

    gap: float = 0.0
    repeat: bool = True
    amplifies: bool = False
    time_step_s: float = 0.0
    space: Space = field(default_factory=lambda: Space(SLOTS))
    fold: np.ndarray = field(default_factory=lambda: np.zeros(2, int))

    def residual(self, thetas):
        delay, gap = np.asarray(thetas).T
        kept = 30.0 * (delay**2 - 1.0), 3.0 * (delay - 1.0)
        play = 100.0 * (gap - self.gap), np.zeros(len(delay))
        return np.stack([*kept, *play], 1)

    def folds(self):
        return np.zeros(4, int)

    def channel_counts(self):
        return np.array([2, 2])


def both(problem, delay):
    """The model without the gap from the shallow valley, and one with it."""
    effects = [(), ("play",)]
    starts = [np.array([-1.0, 0.0]), np.array([delay, problem.gap])]
    return fit_models(problem, effects, starts, rounds=20)


def test_the_smaller_model_follows_into_a_deeper_valley():
    problem = Valleys()
    smaller, larger = both(problem, 1.0)
    assert smaller.fit.theta[0] == pytest.approx(-1.0, abs=0.1)  # negative control
    found = nearer_without(problem, smaller, larger)
    np.testing.assert_allclose(found.fit.theta, [1.0, 0.0], atol=1e-3)
    assert found.effects == () and found.fit.cost < 0.01 * smaller.fit.cost


def test_what_the_effect_does_stays_its_own():
    problem = Valleys(gap=0.5)
    smaller, larger = both(problem, 1.0)
    assert larger.fit.cost < 0.1 * smaller.fit.cost
    found = nearer_without(problem, smaller, larger)
    assert 100.0 * larger.fit.cost < found.fit.cost <= smaller.fit.cost


def test_no_fit_begins_where_a_larger_model_is_no_nearer(monkeypatch):
    problem = Valleys()
    smaller, larger = both(problem, -1.0)
    deeper = both(problem, 1.0)[1]

    def begun(*_args, **_more):
        raise RuntimeError("a fit begins")

    monkeypatch.setattr(nested, "fit_models", begun)
    assert nearer_without(problem, smaller, larger) is smaller
    other = replace(deeper, effects=("slack",))  # holds nothing of what it has
    assert nearer_without(problem, replace(smaller, effects=("play",)), other).effects
    with pytest.raises(RuntimeError, match="begins"):
        nearer_without(problem, smaller, deeper)  # negative control
