"""Which effects does the simulation lack? Fits, held-out scores, forward and backward.

Every effect of the catalogue is fitted, from several starts, beside the nuisances. What
counts is the error on folds that the fit did not see:

    S(M) = Σ_g ‖W r_g(θ̂_{−g})‖² + Σ_i ((θ_i − θ⁰_i) / σ_i)²

with the second sum over the nuisances that stay inside their tolerances σ_i, so that a
figure far out of its tolerance is a finding and not silently absorbed.
"""

from dataclasses import dataclass

import numpy as np

from sysid.diagnosis.search.candidate import Model, fit_models, gain_nat
from sysid.diagnosis.search.coupling import coupled
from sysid.diagnosis.search.exchange import MOST, exchanged, pruned
from sysid.diagnosis.search.problem import Problem
from sysid.diagnosis.search.selection import worth
from sysid.diagnosis.search.stage import extended

EXCESS = 1.5
"""Squared error over the noise above which something may be left to explain."""


@dataclass(frozen=True, eq=False)
class Search:
    """What a search found.

    Attributes:
        problem: with the final noise.
        base: the simulation with its nuisances fitted.
        best: the model that is chosen.
        rivals: for each cause, models in which another effect takes its place, best
            first.
        without: for each cause, the model without it.
        samples: number of residuals that count.
    """

    problem: Problem
    base: Model
    best: Model
    rivals: dict[str, list[Model]]
    without: dict[str, Model]
    samples: int

    def gain(self, worse: Model, better: Model) -> float:
        """Gain in log predictive density [nat], at the error that remains."""
        return gain_nat(worse, better, self.samples)


def search(problem: Problem) -> Search:
    """Runs the whole search on one joint.

    Without repeats it runs again with what the first result leaves as noise.
    """
    problem, base = settled(problem)
    problem = coupled(problem, base)
    found = _searched(problem, base)
    if problem.repeat or not found.best.effects:
        return found
    left = problem.raw(found.best.fit.theta[None], weigh=False)[0]
    problem = problem.with_noise(left)
    base = fit_models(problem, [()], [base.fit.theta])[0]
    return _searched(problem, base)


def _searched(problem: Problem, base: Model) -> Search:
    """Searches at a given noise."""
    samples = int(problem.counts().sum())
    best = base
    rivals: dict[str, list[Model]] = {}
    for _ in range(MOST):
        stage = extended(problem, best)
        better = [m for m in stage if worth(problem, best, m, base)]
        if not better:
            break
        winner = _fullest(better)
        again = _beside(problem, best.effects, winner.fit.theta)
        if again.fit.cost < best.fit.cost:
            better = [m for m in better if worth(problem, again, m, base)]
            if not better:
                break
            winner = _fullest(better)
            if again.score < best.score:
                base = again if not best.effects else base
        best = pruned(problem, winner, base)
        if best.effects != winner.effects:
            break
        if len(best.effects) == 1:
            rivals[best.effects[0]] = [m for m in stage if m is not winner]
    if len(best.effects) == 1 and best.effects[0] in rivals:
        without = {best.effects[0]: base}
    else:
        best, rivals, without = exchanged(problem, best, base)
    return Search(problem, base, best, rivals, without, samples)


def _fullest(better: list[Model]) -> Model:
    """Chooses the first effect, or one that explains what the first leaves.

    Where one moment alone tells a figure, folds without it do not predict that moment,
    however true the figure is.
    """
    first, full = better[0], min(better, key=lambda m: m.errors.max())
    left, rest = first.errors.max() - 1.0, full.errors.max() - 1.0
    return full if left > EXCESS - 1.0 and rest < 0.5 * left else first


def settled(problem: Problem) -> tuple[Problem, Model]:
    """Fits the nuisances and estimates the noise, twice."""
    theta = problem.space.base
    for _ in range(3):
        problem = problem.with_noise(problem.raw(theta[None], weigh=False)[0])
        model = _beside(problem, (), theta)
        theta = model.fit.theta
    return problem, model


def _beside(problem: Problem, effects: tuple[str, ...], theta: np.ndarray) -> Model:
    """Fits from where a fit is, and from delays beside it; returns the best.

    Where targets arrive just when readings are taken, the error has a kink, at which a
    fit would stay.
    """
    slots, starts = problem.space.slots, [theta]
    for i in problem.space.of("transport_delay"):
        for way in (-1.0, 1.0) if 0.0 < slots[i].tight < np.inf else ():
            moved = theta.copy()
            moved[i] = max(moved[i] + way * slots[i].tight, slots[i].low)
            starts.append(moved)
    models = fit_models(problem, [effects] * len(starts), starts)
    return min(models, key=lambda m: m.fit.cost)
