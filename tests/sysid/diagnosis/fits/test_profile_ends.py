"""Intervals of a size that is small beside a step, in a valley: who covers the truth?

Of a made joint friction F takes amplitude, and makes a third harmonic, by its ratio
to the mass μ: x = (1 − ρ) sin t + 4 ρ² sin 3t with ρ = F / μ ρ₀. Only the ratio is
seen, and μ has a tolerance; a step from F to 3.5 F shows another mixture.
"""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid.diagnosis.fits.candidate import Model, task_of
from sysid.diagnosis.fits.parameters import Slot, Space
from sysid.diagnosis.fits.profile import REACHES, _crossing, profiled, resolved
from sysid.least_squares import fit_all

EFFECT, LEVEL, DRAWS = "coulomb_friction", 1.96, 150
SIZE, WHOLE, TOLERANCE, NOISE = 0.004, 0.02, 0.03, 0.02
SLOTS = (
    Slot(EFFECT, "torque_nm", "N·m", "linear", 1.0, 0.0, 0.0, 30.0, 0.0, (), True),
    Slot("", "mass", "1", "log", 1.0, 0.0, -10.0, 10.0, TOLERANCE, (), False),
)
PHASE = 0.1 * np.arange(400)


def swing(friction, mass):
    """Angles of the joint [rad]."""
    share = friction / mass / WHOLE
    return (1.0 - share) * np.sin(PHASE) + 4.0 * share**2 * np.sin(3.0 * PHASE)


def record(rng):
    """The residuals of one record: friction is SIZE, the mass is drawn."""
    read = swing(SIZE, np.exp(TOLERANCE * rng.normal())) + NOISE * rng.normal(size=400)

    def residual(thetas):
        each = [swing(size, np.exp(log_mass)) for size, log_mass in thetas]
        return (read - np.stack(each)) / NOISE

    return SimpleNamespace(
        space=Space(SLOTS), residual=residual, samples=400, time_step_s=0.0
    )


def fitted(problem: Any) -> Model:
    """The fit with differences that are chords; how large noise is, is known."""
    task = task_of(problem, (EFFECT,), np.array([0.3 * SIZE, 0.0]))
    chords = replace(task, steps=np.array([0.01, 0.0015]))
    (fit,) = fit_all(problem.residual, [chords], 10)
    nothing = np.zeros(2)
    return Model((EFFECT,), fit, 0.0, 0.0, nothing[None], nothing, 0.0)


def halves(model):
    """Half the widths by the quadratic."""
    prior = np.diag([5.0**-2, TOLERANCE**-2])
    jacobian = model.fit.jacobian
    return LEVEL * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian + prior)))


def by_profile(problem):
    """The ends that are reported."""
    model = resolved(problem, fitted(problem))
    return profiled(problem, model, halves(model), [0], LEVEL)[0]


def by_quadratic(problem):
    """The ends of the fit as it is."""
    model = fitted(problem)
    return model.fit.theta[0] + np.array([-1.0, 1.0]) * halves(model)[0]


def coverage(ends):
    """Share of the records whose interval holds the friction."""
    rng = np.random.default_rng(5)
    each = [ends(record(rng)) for _ in range(DRAWS)]
    return float(np.mean([low <= SIZE <= high for low, high in each]))


def test_profiles_cover_what_they_say():
    """95 % of 150: 0.91 to 0.99 with a probability of 0.99."""
    assert 0.90 <= coverage(by_profile) <= 0.99


def test_the_quadratic_of_a_chord_does_not():
    assert coverage(by_quadratic) < 0.8


@pytest.mark.parametrize(
    ("rise", "reach"),
    [
        ((3.0, 4.0, 5.0, 6.0), 1.0),
        ((1.0, 2.0, 4.0, 5.0), 2.0),
        ((0.0, 1.0, 3.0, 4.0), 3.0),
        ((0.0, 0.0, 0.0, 0.0), REACHES[-1]),
    ],
)
def test_an_end_is_where_the_cost_has_risen(rise, reach):
    """At 2, on a line between the reaches 1, 2, 4 and 8; never nearer than 1."""
    assert _crossing(np.array(rise), 2.0) == pytest.approx(reach)
