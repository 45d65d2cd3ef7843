"""Least squares with priors for one joint, and the deviations of what it finds.

    θ̂ = argmin ‖r(θ)‖² + ‖(θ − θ₀) / σ‖²

by Levenberg-Marquardt steps. Errors of one second belong together, whatever their
colour: with H = JᵀJ + Σ⁻¹ and the gradient g_b of every block b

    cov θ̂ = H⁻¹ (Σ_b g_b g_bᵀ + Σ⁻¹) H⁻¹

(sandwich estimator). What the data do not show keeps the deviation of its prior.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.stats import t as student

Residual = Callable[[Float[np.ndarray, "c n"]], Float[np.ndarray, "c r"]]
"""Parameters of candidates -> their weighted residuals."""


@dataclass(frozen=True, eq=False)
class Search:
    """One least-squares problem.

    Attributes:
        residuals: of many candidates at once.
        center, deviation: of the prior.
        low, high: bounds.
        step: of differences, in units of the parameters.
        rounds: steps at most.
        enough: gain of a step below which the search ends.
        reach: largest change of a parameter in one step.
        tried: dampings that are tried, as multiples of the last one that helped.
        stretched: factors on steps that are tried too: differences of a chaotic
            simulation are noisy, which makes steps too short.
    """

    residuals: Residual
    center: Float[np.ndarray, " n"]
    deviation: Float[np.ndarray, " n"]
    low: Float[np.ndarray, " n"]
    high: Float[np.ndarray, " n"]
    step: float = 0.01
    rounds: int = 30
    enough: float = 0.02
    reach: float = 1.0
    tried: tuple[float, ...] = (0.1, 1.0, 30.0, 1e3)
    stretched: tuple[float, ...] = (1.0,)

    def cost(self, theta: np.ndarray, residual: np.ndarray) -> float:
        """Value that is minimized."""
        prior = (theta - self.center) / self.deviation
        return float(residual @ residual + prior @ prior)

    def best_of(self, thetas: Float[np.ndarray, "c n"]) -> Float[np.ndarray, " n"]:
        """Returns the candidate with the least cost, large residuals clipped."""
        costs = np.sum(np.clip(self.residuals(thetas), -30.0, 30.0) ** 2, 1)
        return thetas[int(np.argmin(costs))]

    def linear(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual and its Jacobian by central differences."""
        step, n = self.step * np.eye(len(theta)), len(theta)
        both = self.residuals(np.concatenate([theta[None], theta + step, theta - step]))
        return both[0], (both[1 : n + 1] - both[n + 1 :]).T / (2.0 * self.step)

    def solved(self, theta: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Goes downhill from θ."""
        damping = 1e-3
        for _ in range(self.rounds):
            r, jac = self.linear(theta)
            gram = jac.T @ jac + np.diag(self.deviation**-2.0)
            slope = jac.T @ r + (theta - self.center) / self.deviation**2
            tries = damping * np.repeat(self.tried, len(self.stretched))
            free = self._free(theta, slope)
            steps = [
                stretch * _step(gram + d * np.diag(np.diag(gram)), slope, free)
                for d in damping * np.array(self.tried)
                for stretch in self.stretched
            ]
            thetas = np.clip(
                theta + np.clip(steps, -self.reach, self.reach), self.low, self.high
            )
            found = self.residuals(thetas)
            costs = [self.cost(x, y) for x, y in zip(thetas, found, strict=True)]
            best = int(np.argmin(costs))
            gain = self.cost(theta, r) - costs[best]
            if gain <= 0.0:
                damping *= 1e3
                if damping > 1e6:
                    break
                continue
            theta, damping = thetas[best], max(float(tries[best]), 1e-7)
            if gain < self.enough:
                break
        return theta

    def best_solved(
        self, starts: Sequence[Float[np.ndarray, " n"]]
    ) -> Float[np.ndarray, " n"]:
        """Goes downhill from different starts and returns the lowest end."""
        distinct = {tuple(start): start for start in starts}
        ends = [self.solved(start) for start in distinct.values()]
        found = self.residuals(np.array(ends))
        costs = [self.cost(x, y) for x, y in zip(ends, found, strict=True)]
        return ends[int(np.argmin(costs))]

    def _free(self, theta: np.ndarray, slope: np.ndarray) -> Bool[np.ndarray, " n"]:
        """Parameters that do not press against a bound."""
        below = (theta <= self.low) & (slope > 0.0)
        return ~(below | ((theta >= self.high) & (slope < 0.0)))

    def spread(
        self, theta: Float[np.ndarray, " n"], blocks: Int[np.ndarray, " r"]
    ) -> tuple[np.ndarray, float]:
        """Deviations around the solution, and how many of them make 95 %.

        Parameters that the residual hardly feels (less than its own deviation over one
        unit) are not known: NaN.

        Args:
            theta: the solution.
            blocks: number of the block of every residual.
        """
        r, jac = self.linear(theta)
        prior = np.diag(self.deviation**-2.0)
        inverse = np.linalg.inv(jac.T @ jac + prior)
        count = int(blocks.max()) + 1
        scores = np.zeros((count, len(theta)))
        np.add.at(scores, blocks, jac * r[:, None])
        meat = scores.T @ scores * count / max(count - 1, 1) + prior
        deviation = np.sqrt(np.diag(inverse @ meat @ inverse))
        seen = np.sqrt(np.sum(jac**2, 0)) > 1.0
        used = len(np.unique(blocks[r != 0.0]))
        wide = float(student.ppf(0.975, max(used - len(theta), 1)))
        return np.where(seen, deviation, np.nan), wide


def _step(gram: np.ndarray, slope: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Downhill along the free parameters; the others stay."""
    step = np.zeros(len(slope))
    step[free] = np.linalg.solve(gram[np.ix_(free, free)], -slope[free])
    return step
