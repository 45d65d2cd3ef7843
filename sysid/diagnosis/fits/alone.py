"""Fits of one effect alone, or beside what is named: no other takes up what it does."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.fits.candidate import nuisance_penalty, task_of
from sysid.diagnosis.fits.problem import Problem
from sysid.least_squares import fit_all

Sets = Sequence[tuple[str, ...]]
Thetas = Sequence[Float[np.ndarray, " n"]]


def fitted_alone(
    problem: Problem, sets: Sets, starts: Thetas, beside: Sequence[int] = ()
) -> list[np.ndarray]:
    """θ̂_e = argmin ‖r(θ)‖² over the last effect e of each set; the rest stays.

    Args:
        problem: residuals of a joint.
        sets: released effects of every model.
        starts: first coordinates of every model [1].
        beside: indices of coordinates that may change with it; none by default.

    Returns:
        The coordinates of every model.

    Source:
        Ours.
    """
    tasks = [
        replace(
            task_of(problem, effects, start),
            start=start,
            free=np.array(sorted({*problem.space.of(effects[-1]), *beside})),
        )
        for effects, start in zip(sets, starts, strict=True)
    ]
    return [fit.theta for fit in fit_all(problem.residual, tasks, 5)]


def costs(problem: Problem, sets: Sets, thetas: Thetas) -> Float[np.ndarray, " s"]:
    """‖r(θ)‖² + Σ_i ((θ_i − θ⁰_i) / σ_i)² of every set, i all but its effects' own.

    Args:
        problem: residuals of a joint.
        sets: released effects of every model.
        thetas: coordinates of every model [1].

    Source:
        As `Model.score`, of all data.
    """
    errors = np.sum(problem.residual(np.stack(thetas)) ** 2, 1)
    return errors + np.array(
        [
            nuisance_penalty(problem, task_of(problem, effects, theta), effects, theta)
            for effects, theta in zip(sets, thetas, strict=True)
        ]
    )
