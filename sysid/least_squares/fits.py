"""Maximum a-posteriori fits of many candidates side by side.

    θ̂ = argmin ‖W r(θ)‖² + Σ ((θ_i − θ⁰_i) / σ_i)²

by Levenberg-Marquardt steps. Candidates advance together, so that all their
simulations of one round are one batch.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from sysid.least_squares.newton import bounded_step, damped, normal_equations

Residual = Callable[[Float[np.ndarray, "c n"]], Float[np.ndarray, "c r"]]
"""Coordinates of candidates -> their weighted residuals."""


@dataclass(frozen=True, eq=False)
class Task:
    """One fit.

    Attributes:
        start: first coordinates.
        free: indices of those that may change.
        center, deviation: of the prior, for all coordinates.
        low, high: bounds, for all coordinates.
        steps: of the differences, where a coordinate needs its own; else 0.
        fresh: indices whose columns of the Jacobian are never shared.
        central: whether differences are central. Forward ones share the residual at θ,
            which biases the gradient Jᵀr where a chaotic simulation makes it noisy.
    """

    start: Float[np.ndarray, " n"]
    free: Int[np.ndarray, " k"]
    center: Float[np.ndarray, " n"]
    deviation: Float[np.ndarray, " n"]
    low: Float[np.ndarray, " n"]
    high: Float[np.ndarray, " n"]
    steps: Float[np.ndarray, " n"] | None = None
    fresh: tuple[int, ...] = ()
    central: bool = False

    def penalty(self, theta: Float[np.ndarray, " n"]) -> float:
        """Σ ((θ_i − θ⁰_i) / σ_i)² over the free coordinates [1].

        Args:
            theta: θ, in units of the coordinates [1].

        Source:
            −2 log of a Gaussian prior, without its constant.
        """
        k = self.free
        return float(np.sum(((theta - self.center)[k] / self.deviation[k]) ** 2))


@dataclass(frozen=True, eq=False)
class Fit:
    """Where a fit ended.

    Attributes:
        theta: coordinates.
        cost: ‖W r‖² with the penalty of the prior.
        residual: W r.
        jacobian: of W r by the free coordinates.
        free: their indices.
        bounded: free coordinates that ended at a bound.
    """

    theta: Float[np.ndarray, " n"]
    cost: float
    residual: Float[np.ndarray, " r"]
    jacobian: Float[np.ndarray, "r k"]
    free: Int[np.ndarray, " k"]
    bounded: tuple[int, ...]


STEP = 1e-2
"""Step of the differences, in units of the coordinate or of its prior deviation."""

TOO_LONG = 2.0
"""Norm of what a difference changes, in units of that of the residual or its noise,
beyond which it is no slope: where a joint swings at its limit much follows from little,
and a hundredth of a unit may be many times the friction that there is [1]."""

RETAKEN = 3
"""How often a difference that is too long is taken again, shorter, at most."""

LONGEST = 2.0
"""Longest step of a coordinate [1]."""

_TRIED = (0.03, 30.0)
"""Dampings that are tried, as multiples of the last one that helped."""


def fit_all(
    residual: Residual,
    tasks: Sequence[Task],
    rounds: int = 5,
    exact: int = 8,
    shared: dict[int, Float[np.ndarray, " r"]] | None = None,
) -> list[Fit]:
    """θ̂ = argmin ‖W r(θ)‖² + Σ ((θ_i − θ⁰_i) / σ_i)² of every task, side by side.

    Args:
        residual: weighted residuals W r of many candidates, of unit scatter [1].
        tasks: the fits.
        rounds: Levenberg-Marquardt steps.
        exact: number of fits, the best, whose whole Jacobian is found at the end.
        shared: columns of the Jacobian that are otherwise taken as they are.

    Returns:
        One result per task.

    Source:
        D. W. Marquardt, "An Algorithm for Least-Squares Estimation of Nonlinear
        Parameters", Journal of SIAM 11(2), 1963; two dampings a round are ours; bounds:
        `bounded_step`.
    """
    shared = shared or {}
    states = [_State(task) for task in tasks]
    for state, r in zip(
        states, residual(np.stack([s.theta for s in states])), strict=True
    ):
        state.enter(r)
    for _ in range(rounds):
        live = [s for s in states if not s.done]
        if live:
            _derive(residual, live, shared)
            _advance(residual, live)
    best = sorted(states, key=lambda s: s.cost)[:exact]
    _derive(residual, best, {})
    _derive(residual, [s for s in states if s not in best], shared)
    return [state.result() for state in states]


class _State:
    """One fit on its way."""

    def __init__(self, task: Task):
        self.task, self.theta = task, np.clip(task.start, task.low, task.high)
        self.cost, self.r = np.inf, np.zeros(0)
        self.columns: dict[int, np.ndarray] = {}
        self.own: set[int] = set()
        self.damping, self.done = 1e-3, False

    def enter(self, r: np.ndarray) -> None:
        self.r = r
        self.cost = float(r @ r) + self.task.penalty(self.theta)

    def given(self, index: int) -> float:
        """Step that the task gives a coordinate; 0 where it gives none."""
        return 0.0 if self.task.steps is None else float(self.task.steps[index])

    def steps(self, index: int) -> float:
        deviation = self.task.deviation[index]
        step = self.given(index) or STEP * min(1.0, max(deviation, 0.02) * 5.0)
        step = min(step, self.longest(index))
        above = self.theta[index] + step > self.task.high[index]
        return -step if above else step

    def longest(self, index: int) -> float:
        """Step that changes the residual by all that is left of it, or by noise."""
        slope = float(np.linalg.norm(self.columns.get(index, 0.0)))
        if self.given(index) or not 0.0 < slope < np.inf:
            return np.inf
        return max(float(np.linalg.norm(self.r)), len(self.r) ** 0.5) / slope

    def proposals(self) -> list[np.ndarray]:
        task, k = self.task, self.task.free
        j = np.stack([self.columns[i] for i in k], 1)
        away, deviation = (self.theta - task.center)[k], task.deviation[k]
        result = []
        hessian, slope = normal_equations(j, self.r, away, deviation)
        low, high = (task.low - self.theta)[k], (task.high - self.theta)[k]
        for damping in (self.damping * x for x in _TRIED):
            theta, h = self.theta.copy(), damped(hessian, damping)
            step = np.clip(bounded_step(h, slope, low, high), -LONGEST, LONGEST)
            theta[k] = np.clip(theta[k] + step, task.low[k], task.high[k])
            result.append(theta)
        return result

    def choose(self, thetas: list[np.ndarray], rs: np.ndarray) -> None:
        costs = [
            float(r @ r) + self.task.penalty(t) for r, t in zip(rs, thetas, strict=True)
        ]
        costs = [c if np.isfinite(c) else np.inf for c in costs]
        best = int(np.argmin(costs))
        if costs[best] < self.cost:
            self.done = self.cost - costs[best] < 1e-5 * self.cost + 1e-2
            self.theta, self.r, self.cost = thetas[best], rs[best], costs[best]
            self.own = set()
            self.damping = max(self.damping * _TRIED[best], 1e-7)
        else:
            self.done = self.damping > 1e3
            self.damping *= 1e3

    def result(self) -> Fit:
        task, k = self.task, self.task.free
        edge = [i for i in k if self.theta[i] in (task.low[i], task.high[i])]
        j = np.stack([self.columns[i] for i in k], 1)
        return Fit(self.theta, self.cost, self.r, j, k, tuple(edge))


def _derive(residual: Residual, live: list[_State], shared: dict) -> None:
    """Finds Jacobians by forward or central differences where fits have moved since."""
    places = []
    for state in live:
        for i in (i for i in state.task.free if i not in state.own):
            if i in shared and i not in state.task.fresh:
                state.columns[i] = shared[i]
                continue
            state.own.add(i)
            places.append((state, i, state.steps(i)))
    for _ in range(1 + RETAKEN):
        _difference(residual, places)
        places = [
            (state, i, state.steps(i))
            for state, i, step in places
            if abs(step) > TOO_LONG * state.longest(i)
        ]


def _difference(residual: Residual, places: list[tuple[_State, int, float]]) -> None:
    """Takes differences of states by coordinates, with steps."""
    rows = []
    for state, i, step in places:
        for away in (step, -step) if state.task.central else (step,):
            theta = state.theta.copy()
            theta[i] += away
            rows.append(theta)
    found = iter(residual(np.stack(rows)) if rows else ())
    for state, i, step in places:
        ahead = next(found)
        if state.task.central:
            column = (ahead - next(found)) / (2.0 * step)
        else:
            column = (ahead - state.r) / step
        # Beside a simulation that diverges nothing is known of a slope.
        known = bool(np.all(np.isfinite(column)))
        state.columns[i] = column if known else np.zeros_like(column)


def _advance(residual: Residual, live: list[_State]) -> None:
    """Tries steps of two lengths and keeps the best."""
    tried = [state.proposals() for state in live]
    flat = residual(np.stack([t for thetas in tried for t in thetas]))
    many = len(_TRIED)
    for number, (state, thetas) in enumerate(zip(live, tried, strict=True)):
        state.choose(thetas, flat[many * number : many * number + many])
