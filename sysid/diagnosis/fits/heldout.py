"""Parameters without each fold, and the error of what they predict of it.

    θ̂_{−g} ← θ̂_{−g} − H_{−g}⁻¹ (J_{−g}ᵀ r_{−g} + Σ⁻¹ (θ̂_{−g} − θ⁰)),   H = JᵀJ + Σ⁻¹

by Gauss-Newton steps on all other folds with the slopes J of the common optimum, which
is where they begin. The first step is all that most models need. Where parameters
compensate each other along a curve, it leaves the curve, and a fold that nobody fitted
would seem badly predicted although the others are too: steps go on from there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from sysid.diagnosis.fits.problem import Problem
from sysid.least_squares import Fit, Task
from sysid.least_squares.newton import bounded_step, normal_equations, solved

STEPS = 4
"""Largest number of steps without a fold."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """What a fit predicts of folds that it did not see.

    Attributes:
        theta: coordinates without each fold.
        error: Σ_g ‖r_g(θ̂_{−g})‖² [1].
    """

    theta: Float[np.ndarray, "g n"]
    error: float


@dataclass(frozen=True, eq=False)
class _Part:
    """One fit without one fold: the samples that are kept, and what rises too far."""

    fit: Fit
    task: Task
    kept: Bool[np.ndarray, " r"]
    local: list[int]

    def cost(self, theta: np.ndarray, residual: np.ndarray) -> float:
        return float(np.sum(residual[self.kept] ** 2)) + self.task.penalty(theta)

    def moved(self, theta: np.ndarray, residual: np.ndarray) -> np.ndarray:
        """Takes a step; that which all data would still ask for is not of the fold.

        What belongs to a record and not to the mechanism stays.
        """
        fit, task, k = self.fit, self.task, self.fit.free
        hessian, slope = self._quadratic(theta, residual, self.kept)
        common = self._quadratic(fit.theta, fit.residual, np.ones(len(self.kept), bool))
        rest = solved(*common, ~np.isin(k, fit.bounded))
        bounds = ((end - theta)[k] for end in (task.low, task.high))
        moved = theta.copy()
        moved[k] += bounded_step(hessian, slope + hessian @ rest, *bounds)
        moved[k] = np.clip(moved[k], task.low[k], task.high[k])
        moved[self.local] = fit.theta[self.local]
        return moved

    def _quadratic(self, theta: np.ndarray, residual: np.ndarray, kept: np.ndarray):
        """Returns curvature and slope of the cost of the samples kept."""
        k, task = self.fit.free, self.task
        slopes, away = self.fit.jacobian[kept], (theta - task.center)[k]
        return normal_equations(slopes, residual[kept], away, task.deviation[k])


def held_out(
    problem: Problem, tasks: Sequence[Task], fits: Sequence[Fit]
) -> list[HeldOut]:
    """Predicts every fold from the others.

    Args:
        problem: residuals of a joint.
        tasks: what was fitted.
        fits: where it ended.

    Returns:
        One for every fit.

    Source:
        Cross-validation: M. Stone, Cross-validatory choice and assessment of
        statistical predictions, 1974. Steps from the common optimum with its slopes
        are ours (chord method).
    """
    folds, count = problem.folds(), int(problem.fold.max()) + 1
    local = problem.space.local()
    parts = [
        _Part(fit, task, folds != g, local)
        for fit, task in zip(fits, tasks, strict=True)
        for g in range(count)
    ]
    thetas = np.stack([p.moved(p.fit.theta, p.fit.residual) for p in parts])
    residuals = problem.residual(thetas)
    going = list(range(len(parts)))
    for _ in range(STEPS - 1):
        going = [i for i in going if _rises(parts[i], thetas[i], residuals[i])]
        if not going:
            break
        tried = np.stack([parts[i].moved(thetas[i], residuals[i]) for i in going])
        found = problem.residual(tried)
        nearer = [
            n
            for n, i in enumerate(going)
            if parts[i].cost(tried[n], found[n])
            < parts[i].cost(thetas[i], residuals[i])
        ]
        going = [going[n] for n in nearer]
        thetas[going], residuals[going] = tried[nearer], found[nearer]
    return [
        _of_fit(thetas[i : i + count], residuals[i : i + count], folds)
        for i in range(0, len(parts), count)
    ]


def _rises(part: _Part, theta: np.ndarray, residual: np.ndarray) -> bool:
    """Whether the folds that were fitted err more than at the common optimum.

    They cannot at their own; half a nat of the error that remains is let pass.
    """
    best = part.cost(part.fit.theta, part.fit.residual)
    cost = part.cost(theta, residual)
    let = max(1.0, best / max(int(part.kept.sum()), 1))
    return bool(np.isfinite(cost)) and cost > best + let


def _of_fit(thetas: np.ndarray, residuals: np.ndarray, folds: np.ndarray) -> HeldOut:
    seen = folds[None] == np.arange(len(thetas))[:, None]
    error = float(np.sum(np.where(seen, residuals, 0.0) ** 2))
    return HeldOut(thetas, error)
