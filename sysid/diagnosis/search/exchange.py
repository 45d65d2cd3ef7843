"""Causes that give way: to nothing, or to other effects in their places."""

from sysid.diagnosis.fits.candidate import Model, fit_models, likelihood_gap
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.search.contained import plainer, shows_more
from sysid.diagnosis.search.judge import Judge
from sysid.diagnosis.search.selection import accepted
from sysid.diagnosis.search.stage import NESTED_SHARE, deciding_gap, extended

MOST = 3
"""Largest number of causes."""


def pruned(problem: Problem, model: Model, base: Model) -> Model:
    """Drops effects that a larger model no longer needs."""
    while len(model.effects) > 1:
        sets = [tuple(e for e in model.effects if e != out) for out in model.effects]
        smaller = fit_models(problem, sets, [model.fit.theta] * len(sets))
        best = min(smaller, key=lambda m: m.score)
        if accepted(problem, best, model, base):
            return model
        model = best
    return model


def exchanged(
    problem: Problem, best: Model, base: Model, judge: Judge
) -> tuple[Model, dict[str, list[Model]], dict[str, Model]]:
    """Lets other effects take the places of causes while that is better.

    The first cause of several was chosen when it stood for all of them. One that is not
    accepted together with the others goes, that with the least evidence first.

    Returns:
        The model, and for each cause its alternatives and the model without it.
    """
    samples = problem.samples
    for _ in range(2 * MOST):
        others, without = swapped(problem, best, base)
        idle = [
            c
            for c in best.effects
            if not accepted(problem, without[c], best, base)
            or not judge.confirms(without[c], best)
        ]
        if idle:
            gaps = {c: likelihood_gap(without[c], best, samples) for c in idle}
            best = without[min(gaps, key=gaps.__getitem__)]
            continue
        for cause, stage in others.items():
            plain = plainer(judge, without[cause], best, stage)
            if plain and accepted(problem, without[cause], plain, base):
                better = [plain]
                break
            gain = likelihood_gap(without[cause], best, samples)
            better = [
                m
                for m in stage
                if likelihood_gap(best, m, samples)
                > max(NESTED_SHARE * gain, deciding_gap(problem, cause, m, gain))
                and accepted(problem, without[cause], m, base)
                and judge.confirms(without[cause], m)
                and shows_more(judge, best, m)
                and not plainer(judge, without[cause], m, stage)
            ]
            if better:
                break
        else:
            return best, others, without
        best = pruned(problem, better[0], base)
    return best, *swapped(problem, best, base)


def swapped(
    problem: Problem, best: Model, base: Model
) -> tuple[dict[str, list[Model]], dict[str, Model]]:
    """Lets every other effect take the place of each cause, and none."""
    alternatives, without = {}, {}
    for cause in best.effects:
        rest = tuple(e for e in best.effects if e != cause)
        refit = fit_models(problem, [rest], [best.fit.theta])[0] if rest else base
        without[cause] = refit
        stage = extended(problem, without[cause])
        alternatives[cause] = [m for m in stage if cause not in m.effects]
    return alternatives, without
