"""Causes side by side: those that are not needed go, better ones take their places."""

from sysid.diagnosis.search.candidate import Model, fit_models, gain_nat
from sysid.diagnosis.search.problem import Problem
from sysid.diagnosis.search.selection import worth
from sysid.diagnosis.search.stage import NEARLY, extended

MOST = 3
"""Largest number of causes."""


def pruned(problem: Problem, model: Model, base: Model) -> Model:
    """Drops effects that a larger model no longer needs."""
    while len(model.effects) > 1:
        sets = [tuple(e for e in model.effects if e != out) for out in model.effects]
        smaller = fit_models(problem, sets, [model.fit.theta] * len(sets))
        best = min(smaller, key=lambda m: m.score)
        if worth(problem, best, model, base):
            return model
        model = best
    return model


def exchanged(
    problem: Problem, best: Model, base: Model
) -> tuple[Model, dict[str, list[Model]], dict[str, Model]]:
    """Lets other effects take the places of causes while that is better.

    The first cause of several was chosen when it stood for all of them. One that is not
    worth it beside the others goes.

    Returns:
        The model, and for each cause its rivals and the model without it.
    """
    samples = int(problem.counts().sum())
    for _ in range(MOST):
        rivals, without = swapped(problem, best, base)
        idle = [c for c in best.effects if not worth(problem, without[c], best, base)]
        if idle and len(best.effects) > 1:
            best = without[idle[0]]
            continue
        for cause, stage in rivals.items():
            least = NEARLY * gain_nat(without[cause], best, samples)
            better = [
                m
                for m in stage
                if gain_nat(best, m, samples) > max(3.0, least)
                and worth(problem, without[cause], m, base)
            ]
            if better:
                break
        else:
            return best, rivals, without
        best = pruned(problem, better[0], base)
    return best, *swapped(problem, best, base)


def swapped(
    problem: Problem, best: Model, base: Model
) -> tuple[dict[str, list[Model]], dict[str, Model]]:
    """Lets every other effect take the place of each cause, and none."""
    rivals, without = {}, {}
    for cause in best.effects:
        rest = tuple(e for e in best.effects if e != cause)
        refit = fit_models(problem, [rest], [best.fit.theta])[0] if rest else base
        without[cause] = refit
        stage = extended(problem, without[cause])
        rivals[cause] = [m for m in stage if cause not in m.effects]
    return rivals, without
