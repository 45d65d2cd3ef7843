"""Parameters without each fold, and the error of what they predict of it.

    θ̂_{−g} ← θ̂_{−g} − H_{−g}⁻¹ (J_{−g}ᵀ r_{−g} + Σ⁻¹ (θ̂_{−g} − θ⁰)),   H = JᵀJ + Σ⁻¹

by Gauss-Newton steps on all other folds with the slopes J of the common optimum, which
is where they begin. The first step is all that most models need. Where parameters
compensate each other along a curve, it leaves the curve, and a fold that nobody fitted
would seem badly predicted although the others are too: steps go on from there. And what
turns back near the common optimum, as the cosine of an angle does, has next to no slope
there and goes far, and from there no further step helps: it is damped,

    θ̂_{−g} = θ̂ − (H_{−g} + λ I)⁻¹ (J_{−g}ᵀ r_{−g} + Σ⁻¹ (θ̂ − θ⁰))

which holds what hardly shows, and leaves what shows well.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from sysid.diagnosis.fits.problem import Problem
from sysid.least_squares import Fit, Task
from sysid.least_squares.newton import bounded_step, normal_equations, solved

STEPS = 4
"""Largest number of steps without a fold."""

DAMPINGS = (1.0, 10.0, 100.0)
"""λ of a step that raises the folds that were fitted if no further one leads back, in
turn: one unit of a coordinate matters, and no slope is trusted that far [1]."""


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

    def moved(
        self, theta: np.ndarray, residual: np.ndarray, damping: float = 0.0
    ) -> np.ndarray:
        """Takes a step; that which all data would still ask for is not of the fold.

        What belongs to a record and not to the mechanism stays.
        """
        fit, task, k = self.fit, self.task, self.fit.free
        hessian, slope = self._quadratic(theta, residual, self.kept)
        common = self._quadratic(fit.theta, fit.residual, np.ones(len(self.kept), bool))
        rest = solved(*common, ~np.isin(k, fit.bounded))
        held = np.isin(k, self.local)
        bounds = (
            np.where(held, 0.0, (end - theta)[k]) for end in (task.low, task.high)
        )
        slope, moved = slope + hessian @ rest, theta.copy()
        moved[k] += bounded_step(hessian + damping * np.eye(len(k)), slope, *bounds)
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
        are ours (chord method); damping: K. Levenberg, A Method for the Solution of
        Certain Non-Linear Problems in Least Squares, 1944.
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
    now, lost = (thetas, residuals), []
    going = _rising(parts, now, range(len(parts)))
    for _ in range(STEPS - 1):
        tried = [parts[i].moved(thetas[i], residuals[i]) for i in going]
        nearer = _taken(problem, parts, now, going, tried)
        lost += [i for i in going if i not in nearer]
        going = _rising(parts, now, nearer)
    for damping in DAMPINGS:
        lost = _rising(parts, now, lost)
        optima = [(parts[i], parts[i].fit) for i in lost]
        tried = [part.moved(fit.theta, fit.residual, damping) for part, fit in optima]
        _taken(problem, parts, now, lost, tried)
    return [
        _of_fit(thetas[i : i + count], residuals[i : i + count], folds)
        for i in range(0, len(parts), count)
    ]


def predicted(
    problem: Problem, thetas: Float[np.ndarray, "g n"]
) -> Float[np.ndarray, " r"]:
    """Whitened residuals ε_i(θ̂_{−g(i)}) of what a model predicts of each fold [1].

    Args:
        problem: residuals of a joint.
        thetas: coordinates θ̂_{−g} without each fold g [1].

    Source:
        Ours; `held_out`.
    """
    return _unseen(problem.residual(thetas), problem.folds())


def _taken(
    problem: Problem,
    parts: list[_Part],
    now: tuple[np.ndarray, np.ndarray],
    going: list[int],
    tried: list[np.ndarray],
) -> list[int]:
    """Puts what errs less on its folds in the place of where it is; returns which."""
    if not going:
        return []
    thetas, residuals = now
    nearer, found = [], problem.residual(np.stack(tried))
    for i, theta, residual in zip(going, tried, found, strict=True):
        if parts[i].cost(theta, residual) < parts[i].cost(thetas[i], residuals[i]):
            thetas[i], residuals[i] = theta, residual
            nearer.append(i)
    return nearer


def _rising(
    parts: list[_Part], now: tuple[np.ndarray, np.ndarray], which: Iterable[int]
) -> list[int]:
    return [i for i in which if _rises(parts[i], now[0][i], now[1][i])]


def _rises(part: _Part, theta: np.ndarray, residual: np.ndarray) -> bool:
    """Whether the folds that were fitted err more than at the common optimum.

    They cannot at their own; half a nat of the error that remains is let pass.
    """
    best = part.cost(part.fit.theta, part.fit.residual)
    cost = part.cost(theta, residual)
    let = max(1.0, best / max(int(part.kept.sum()), 1))
    return bool(np.isfinite(cost)) and cost > best + let


def _of_fit(thetas: np.ndarray, residuals: np.ndarray, folds: np.ndarray) -> HeldOut:
    return HeldOut(thetas, float(np.sum(_unseen(residuals, folds) ** 2)))


def _unseen(residuals: np.ndarray, folds: np.ndarray) -> np.ndarray:
    """Returns of every residual that of the parameters without its fold."""
    return np.take_along_axis(residuals, folds[None], 0)[0]
