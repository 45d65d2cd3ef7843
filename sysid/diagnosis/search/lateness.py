"""A late target and a late reading, compared where both are as late."""

from collections.abc import Sequence

from sysid.diagnosis.fits.candidate import CONVERGED, Model, fit_models
from sysid.diagnosis.fits.problem import Problem

LATE = ("transport_delay", "sensor_latency")
"""Effects by which a joint is late."""


def as_late(problem: Problem, models: Sequence[Model]) -> list[Model]:
    """Fits the further of the two effects once more, from as late as the nearer one.

    Both move a joint alike, but for what the servo does with late readings: where one
    is near the other cannot be far. An effort that jumps with its targets has a valley
    at every cycle of the servo, and which of them a fit ends in would decide between
    the two.

    Args:
        problem: residuals of a joint.
        models: of one stage, each with one effect more than the same model.

    Returns:
        The fit; none if the stage lacks one of the two.

    Source:
        Ours.
    """
    late = [m for m in models if m.effects[-1] in LATE]
    late.sort(key=lambda m: m.fit.cost)
    sets = list(dict.fromkeys(m.effects for m in late))
    if len(sets) < len(LATE):
        return []
    slots, theta = problem.space.slots, late[0].fit.theta.copy()
    (near,), (far,) = (problem.space.of(effects[-1]) for effects in sets)
    late_s = float(slots[near].value(theta[near]))
    theta[near], theta[far] = slots[near].nominal, slots[far].coordinate(late_s)
    return fit_models(problem, [sets[1]], [theta], rounds=CONVERGED)
