"""The judge: a cause counts if the simulation with it predicts the motion better.

Equation errors find causes; but an effect may cancel a term of an equation, and then
the residual shrinks although nothing moves as it did. So the simulation runs with and
without the effect (`closed_loop`), each time with parameters that were estimated
without the stretch that is predicted, and without the effect within their tolerances:
an error that a parameter out of its tolerance would hide is there. With their angle
errors e₀ and e₁ there, and the means d_b of e₀² − e₁² over blocks of a second,

    t = d̄ √B / s_d

must exceed `LEVEL`.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.replay.band import EVERY, sample_rows
from sysid.diagnosis.search.candidate import Model, fit_models
from sysid.diagnosis.search.closed_loop import simulated
from sysid.diagnosis.search.parameters import Slot, Space
from sysid.diagnosis.search.problem import Problem
from sysid.diagnosis.search.space import SIGMA

LEVEL = 1.0
"""Least t of a difference that counts."""

BLOCK_S = 1.0
"""Length of a block [s]."""

TRIED = 5
"""Number of candidates of a stage that are judged, best first."""


class Judge:
    """Compares simulations of one joint; each model is simulated once."""

    def __init__(self, problem: Problem):
        self.problem = problem
        self.valid = problem.data.valid & (problem.known != "controller")
        self.errors: dict[int, tuple[Model, np.ndarray]] = {}
        self.bounded: dict[int, tuple[Model, Model]] = {}

    @property
    def sees(self) -> bool:
        """Whether there is a motion that can be simulated at all."""
        return bool(self.valid.any())

    def nominal(self, model: Model) -> Model:
        """Returns a model with its other parameters fitted within their tolerances."""
        if id(model) not in self.bounded:
            slots = [_within(s, model.effects) for s in self.problem.space.slots]
            problem = replace(self.problem, space=Space(tuple(slots)))
            fit = fit_models(problem, [model.effects], [model.fit.theta])[0]
            self.bounded[id(model)] = (model, fit)
        return self.bounded[id(model)][1]

    def error(self, model: Model) -> Float[np.ndarray, "m p"]:
        """E = y − ŷ(θ̂_{−g}), the error of the angle on held-out folds g [rad].

        Args:
            model: a fitted model.

        Source:
            Ours; `closed_loop.simulated` at the parameters without the fold.
        """
        if id(model) not in self.errors:
            problem = self.problem
            rows = sample_rows(len(problem.data.track.cmd))
            measured = np.asarray(problem.data.track.pos, float)
            each = (measured - simulated(problem, model.fold_theta))[:, rows]
            error = np.take_along_axis(each, problem.fold[None], 0)[0]
            self.errors[id(model)] = (model, np.nan_to_num(error, nan=np.inf))
        return self.errors[id(model)][1]

    def t_value(self, worse: Model, better: Model) -> float:
        """T = d̄ √B / s_d of the block means d of e₀² − e₁² [1].

        Args:
            worse: the model of e₀.
            better: that of e₁.

        Source:
            F. X. Diebold, R. S. Mariano, Comparing Predictive Accuracy, Journal of
            Business & Economic Statistics 13(3), 1995.
        """
        before, after = (np.minimum(self.error(m) ** 2, 1e12) for m in (worse, better))
        size = max(1, round(BLOCK_S / (EVERY * self.problem.data.dt)))
        gained = np.where(self.valid, before - after, 0.0)
        edges = np.arange(0, len(gained), size)
        sums = np.add.reduceat(gained, edges).ravel()
        counts = np.add.reduceat(self.valid * 1.0, edges).ravel()
        means = sums[counts > 0.5 * size] / counts[counts > 0.5 * size]
        if len(means) < 2:
            return 0.0
        scatter = float(np.std(means, ddof=1)) / np.sqrt(len(means))
        return float(np.mean(means)) / max(scatter, 1e-300)

    def confirms(self, smaller: Model, larger: Model) -> bool:
        """Whether the larger model predicts angles better than the smaller one."""
        if not self.sees:
            return True
        return self.t_value(self.nominal(smaller), larger) > LEVEL


def _within(slot: Slot, effects: tuple[str, ...]) -> Slot:
    """Keeps a nominal parameter within its tolerance."""
    if slot.effect in effects or slot.prior_sd == 0.0:
        return slot
    reach = slot.prior_sd / SIGMA
    low, high = slot.nominal - reach, slot.nominal + reach
    return replace(slot, low=max(slot.low, low), high=min(slot.high, high))
