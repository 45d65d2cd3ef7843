"""Fits that keep what is nominal within its tolerance."""

from dataclasses import replace

from sysid.diagnosis.fits.candidate import CONVERGED, Model, fit_models
from sysid.diagnosis.fits.parameters import Slot, Space
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.fits.refolded import refolded
from sysid.diagnosis.fits.space import SIGMA


def within_tolerances(problem: Problem, model: Model) -> Model:
    """Fits a model with its other parameters within their tolerances.

    Args:
        problem: to whose residuals.
        model: where the fit begins.
    """
    slots = [_within(s, model.effects) for s in problem.space.slots]
    bounded = replace(problem, space=Space(tuple(slots)))
    starts = [model.fit.theta]
    fit = fit_models(bounded, [model.effects], starts, rounds=CONVERGED)[0]
    return refolded(bounded, fit)


def _within(slot: Slot, effects: tuple[str, ...]) -> Slot:
    """Keeps a nominal parameter within its tolerance."""
    if slot.effect in effects or slot.prior_sd == 0.0:
        return slot
    reach = slot.prior_sd / SIGMA
    low, high = slot.nominal - reach, slot.nominal + reach
    return replace(slot, low=max(slot.low, low), high=min(slot.high, high))
