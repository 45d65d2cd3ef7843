"""Gains of a servo that nobody knows, as the logged effort shows them to a model."""

from dataclasses import replace

import numpy as np

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.fits.intervals import standard_errors
from sysid.diagnosis.fits.parameters import Space
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.fits.space import SIGMA

GAIN_TOLERANCE = 0.05
"""Least tolerance of gains that the effort shows [1]."""


def shown_gains(problem: Problem, model: Model) -> Space:
    """Returns the coordinates with unknown gains as sure as the effort shows them.

    θ⁰_i = θ̂_i and σ_i the larger of its standard error and that of `GAIN_TOLERANCE`.

    Args:
        problem: the equations, with the effort.
        model: fitted to them.

    Returns:
        The space itself where gains are known or an effort was not logged.

    Source:
        Ours.
    """
    space = problem.space
    found = [i for e in ("stiffness", "damping") for i in space.of(e)]
    gains = [i for i in found if np.isinf(space.slots[i].prior_sd)]
    if not gains or not problem.data.effort.all():
        return space
    slots = list(space.slots)
    sigma = standard_errors(problem, model, problem.samples)
    for i in gains:
        sd = max(SIGMA * GAIN_TOLERANCE, float(sigma[i]))
        slots[i] = replace(slots[i], nominal=float(model.fit.theta[i]), prior_sd=sd)
    return Space(tuple(slots))
