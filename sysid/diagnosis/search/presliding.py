"""Dry friction gives a little before it slips: when that is a hysteresis, and when not.

A hysteresis whose range is within the noise of a reading is dry friction as far as
readings show; what it gains is of the moments at which the motion reverses, where the
models of friction differ and no one of them is true.
"""

from sysid.diagnosis.search.candidate import Model
from sysid.diagnosis.search.problem import Problem

RESOLVED = 4.0
"""Presliding range from which on readings show it [standard deviations of an angle]."""


def is_dry(problem: Problem, model: Model) -> bool:
    """Whether a model's hysteresis is dry friction, d ≤ 4 σ_q.

    Args:
        problem: residuals of a joint, with the noise σ_q of its angle [rad].
        model: a fitted model; false for one without hysteresis.

    Source:
        Ours; the limit d → 0 of Dahl's model is Coulomb friction (P. Dahl, Solid
        Friction Damping of Mechanical Vibrations, AIAA Journal 14(12), 1976).
    """
    if "hysteresis" not in model.effects:
        return False
    space = problem.space
    ranges = [
        float(space.slots[i].value(model.fit.theta[i]))
        for i in space.of("hysteresis")
        if not space.slots[i].is_size
    ]
    return max(ranges) <= RESOLVED * problem.data.noise[0]
