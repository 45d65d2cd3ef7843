"""Parameters without each fold, fitted anew where a fold is a setting or a load.

Such a fold is half of what was measured, at gains or under loads that the other half
does not have. Steps with the slopes of the common optimum (`heldout`) end beside the
optimum of the other half then, and what is predicted from there is worse than what that
half says: of 16 records of a servo at four gains 76 mrad instead of 56. Half of the
gains or loads does not show every parameter: without repeats what the model leaves
counts as noise, as in a second search, so that tolerances hold what is not shown.
"""

from dataclasses import replace

import numpy as np

from sysid.diagnosis.fits.candidate import CONVERGED, Model, task_of
from sysid.diagnosis.fits.heldout import predicted
from sysid.diagnosis.fits.problem import Problem
from sysid.least_squares import fit_all


def refolded(problem: Problem, model: Model) -> Model:
    """Returns a model with θ̂_{−g} = argmin_θ of the other folds, and its score.

    Args:
        problem: to whose residuals the model was fitted.
        model: where the fits begin, and what belongs to a record alone.

    Returns:
        The model itself where folds are of time or records.

    Source:
        Cross-validation: M. Stone, Cross-validatory choice and assessment of
        statistical predictions, 1974.
    """
    if not problem.whole:
        return model
    noisy = problem
    if not problem.repeat:
        noisy = problem.with_remaining(problem.raw(model.fit.theta[None])[0])
    folds = range(len(model.fold_theta))
    thetas = np.stack([_without(noisy, model, fold) for fold in folds])
    error = float(np.sum(predicted(problem, thetas) ** 2))
    return replace(model, fold_theta=thetas, score=error + model.penalty)


def _without(problem: Problem, model: Model, fold: int) -> np.ndarray:
    """Fits a model without one fold, from the common optimum and from beside it."""
    kept = replace(problem, valid=problem.valid & (problem.fold != fold))
    # What belongs to a record alone is as in the common fit: others do not show it.
    common, own = model.fit.theta, problem.space.local()
    beside = model.fold_theta[fold].copy()
    beside[own] = common[own]
    tasks = [task_of(kept, model.effects, start) for start in (beside, common)]
    tasks = [replace(task, free=np.setdiff1d(task.free, own)) for task in tasks]
    fits = fit_all(kept.residual, tasks, CONVERGED)
    return min(fits, key=lambda fit: fit.cost).theta
