"""Dry friction gives a little before it slips: when that is a hysteresis, and when not.

A hysteresis whose range drowns in the noise of the angle is dry friction as far as
readings show; what it gains is of the moments at which the motion reverses, where the
models of friction differ and no one of them is true.
"""

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.fits.problem import Problem

RESOLVED = 4.0
"""Presliding range from which on readings show it [standard deviations of the angle's
noise at a step of the grid]."""

DRY_SHARE = 0.1
"""Share of a gain by which a hysteresis that is dry friction must be ahead of it."""


def is_dry(problem: Problem, model: Model) -> bool:
    """Whether the effect added last is a hysteresis that is dry friction, d ≤ 4 σ_q.

    Args:
        problem: residuals of a joint, with the noise σ_q of its angle at a step of the
            grid [rad]; where several readings fall into a step, that of their mean.
        model: a fitted model.

    Source:
        Ours; the limit d → 0 of Dahl's model is Coulomb friction (P. Dahl, Solid
        Friction Damping of Mechanical Vibrations, AIAA Journal 14(12), 1976).
    """
    if model.effects[-1:] != ("hysteresis",):
        return False
    space = problem.space
    ranges = [
        float(space.slots[i].value(model.fit.theta[i]))
        for i in space.of("hysteresis")
        if not space.slots[i].is_size
    ]
    return max(ranges) <= RESOLVED * problem.data.noise[0]


def repeats_friction(problem: Problem, model: Model) -> bool:
    """Whether it adds a hysteresis that is dry friction to dry friction itself.

    Args:
        problem: residuals of a joint.
        model: a fitted model.
    """
    return "coulomb_friction" in model.effects and is_dry(problem, model)
