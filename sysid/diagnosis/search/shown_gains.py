"""Gains of a servo that are hardly known, as the logged effort shows them."""

from dataclasses import replace

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.fits.intervals import standard_errors
from sysid.diagnosis.fits.parameters import Slot, Space
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.fits.space import SIGMA

GAIN_TOLERANCE = 0.05
"""Least tolerance of gains that the effort shows [1]."""

SURER = 2.0
"""How much surer than its tolerance an effort must show a gain [1]: with a tolerance of
10 % or less both say about the same, and what the user says stands."""

GAINS = ("stiffness", "damping")


def shown_gains(problem: Problem, model: Model) -> Space:
    """Returns the coordinates with gains as sure as the effort shows them.

    θ⁰_i = θ̂_i and σ_i the larger of its standard error and that of `GAIN_TOLERANCE`,
    where the tolerance that it was given is more than `SURER` times that, and θ⁰_i
    within that tolerance: what was logged knows a gain better than who says that it is
    right to a half.

    Args:
        problem: the equations, with the effort.
        model: fitted to them.

    Returns:
        The space itself where gains are known as well, or an effort was not logged.
        Gains that are effects of the model stay as they are.

    Source:
        Ours; a posterior of one residual is the prior of the other.
    """
    space, least = problem.space, SURER * SIGMA * GAIN_TOLERANCE
    names = [e for e in GAINS if e not in model.effects]
    unsure = [i for e in names for i in space.of(e) if space.slots[i].prior_sd > least]
    if not unsure or not problem.data.effort.all():
        return space
    slots = list(space.slots)
    sigma = standard_errors(problem, model, problem.samples)
    for i in unsure:
        slots[i] = _shown(slots[i], float(model.fit.theta[i]), float(sigma[i]))
    return space if slots == list(space.slots) else Space(tuple(slots))


def _shown(slot: Slot, theta: float, sigma: float) -> Slot:
    """Returns the slot of a gain, with what the effort shows of it."""
    sd = max(SIGMA * GAIN_TOLERANCE, sigma)
    if slot.prior_sd <= SURER * sd:
        return slot
    reach = slot.prior_sd / SIGMA
    theta = min(max(theta, slot.nominal - reach), slot.nominal + reach)
    return replace(slot, nominal=theta, prior_sd=sd)
