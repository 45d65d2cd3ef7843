"""What a search begins with: nuisance parameters and noise of the nominal model."""

import numpy as np

from sysid.diagnosis.fits.candidate import Model, fit_models
from sysid.diagnosis.fits.clock import without_drift
from sysid.diagnosis.fits.origins import begun_anew
from sysid.diagnosis.fits.problem import Problem


def settled(problem: Problem) -> tuple[Problem, Model]:
    """Fits the nuisance parameters and estimates the noise, in turns."""
    theta = problem.space.nominal
    for _ in range(3):
        problem = problem.with_noise(without_drift(problem, theta))
        model = begun_anew(problem, refitted(problem, (), theta))
        theta = model.fit.theta
    return problem, model


def refitted(problem: Problem, effects: tuple[str, ...], theta: np.ndarray) -> Model:
    """Fits from where a fit is, and from other delays; returns the best.

    Where targets arrive just when readings are taken, the error has a kink, at which a
    fit would stay.
    """
    slots, starts = problem.space.slots, [theta]
    for i in problem.space.of("transport_delay"):
        for way in (-1.0, 1.0) if 0.0 < slots[i].prior_sd < np.inf else ():
            moved = theta.copy()
            moved[i] = max(moved[i] + way * slots[i].prior_sd, slots[i].low)
            starts.append(moved)
    return fit_models(problem, [effects] * len(starts), starts, nearest=True)[0]
