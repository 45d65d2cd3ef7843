"""What one moment alone shows is held out in parts of it."""

from dataclasses import replace

import numpy as np

from sysid.diagnosis.fits.candidate import Model, fit_models
from sysid.diagnosis.fits.heldout import predicted
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.likelihood.folds import shorter_blocks

EXCESS = 1.5
"""Mean squared whitened residual above which something may be unexplained."""

MOST_SQUARE = 1e12
"""Squared whitened residual that stands for what diverges [1]."""


def in_parts(problem: Problem, base: Model) -> tuple[Problem, Model]:
    """Holds out parts of a moment that alone has nearly all of the nominal error.

    Nominal parameters far off their priors may fit that moment; then nearly all of the
    error is in what the others predict of it.
    """
    if problem.whole:
        return problem, base
    counted, shape = problem.counts(), (2, *problem.fold.shape)
    for error in (base.fit.residual, predicted(problem, base.fold_theta)):
        squares = np.minimum(np.nan_to_num(error**2, nan=np.inf), MOST_SQUARE)
        sums = squares.reshape(2, -1).sum(1)
        if np.all(sums <= EXCESS * problem.channel_counts()):
            continue
        excess = (squares - counted).reshape(shape).sum(0)
        parts = problem.data, problem.repeat, problem.fold, excess
        fold, block_s = shorter_blocks(*parts)
        if not np.array_equal(fold, problem.fold):
            problem = replace(problem, fold=fold, block_s=block_s)
            return problem, fit_models(problem, [()], [base.fit.theta])[0]
    return problem, base
