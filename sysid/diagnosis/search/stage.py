"""One stage of the search: every effect that a model lacks is added and fitted."""

from sysid.diagnosis.replay.link import EFFECTS as LINK_EFFECTS
from sysid.diagnosis.search.candidate import (
    Model,
    at_nominal,
    fit_models,
    log_likelihood_gain,
)
from sysid.diagnosis.search.problem import Problem
from sysid.diagnosis.search.selection import MODEL_ERROR
from sysid.diagnosis.search.starts import starts_of

REFINED = 3
"""Number of candidates whose fits are continued."""

OFF_PRIOR_PENALTY = 16.0
"""Penalty of nuisance parameters above which a fit is also continued from nominal."""

NESTED = {"coulomb_friction": ("stribeck_friction", "hysteresis")}
"""Effects that become another one at an end of their shape: they contain it, and are no
alternatives to it."""

NESTED_SHARE = 0.015
"""Share of a gain that does not decide between an effect and one that contains it: what
gives in dry friction before it slips is less than an encoder resolves."""


def extended(problem: Problem, model: Model) -> list[Model]:
    """Adds every effect that a model lacks, best first."""
    names = [e for e in problem.space.effects if _fits_in(e, model.effects)]
    sets = [(*model.effects, name) for name in names]
    starts = starts_of(problem, model, names)
    jobs = [(s, t) for s, name in zip(sets, names, strict=True) for t in starts[name]]
    shared = dict(zip(model.fit.free.tolist(), model.fit.jacobian.T, strict=True))
    models = fit_models(problem, [j[0] for j in jobs], [j[1] for j in jobs], shared)
    best: dict[tuple, Model] = {}
    for m in models:
        if m.effects not in best or m.fit.cost < best[m.effects].fit.cost:
            best[m.effects] = m
    stage = _refined(problem, model, list(best.values()))
    return _simplest_first(problem, model, stage)


def _fits_in(effect: str, effects: tuple[str, ...]) -> bool:
    """Whether an effect can act with others: only one thing moves the link."""
    taken = effect in LINK_EFFECTS and any(e in LINK_EFFECTS for e in effects)
    return effect not in effects and not taken


def _refined(problem: Problem, smaller: Model, stage: list[Model]) -> list[Model]:
    """Continues the fits that are nearest to the records; best first.

    Masses, loads and rotors that a large effect has moved off their priors compensate
    each other: from there every step leaves a narrow, curved valley. So those fits are
    continued from nominal too.
    """

    def order(m: Model) -> float:
        return -log_likelihood_gain(smaller, m, problem.samples)

    near = sorted(stage, key=lambda m: m.fit.cost)[:REFINED]
    ranked = sorted(stage, key=order)
    far = 0.9 * order(ranked[0]) if ranked else 0.0
    close = ranked[:REFINED] + [m for m in ranked[REFINED:] if order(m) < far]
    near += [m for m in close if m not in near]
    jobs = [(m.effects, m.fit.theta) for m in near]
    jobs += [
        (m.effects, at_nominal(problem, m))
        for m in near
        if m.penalty > OFF_PRIOR_PENALTY
    ]
    models = fit_models(problem, [j[0] for j in jobs], [j[1] for j in jobs], rounds=10)
    models = sorted(models, key=lambda m: -m.fit.cost)
    again = {m.effects: m for m in models}  # the last one is the best
    return sorted((again.get(m.effects, m) for m in stage), key=order)


def _simplest_first(
    problem: Problem, smaller: Model, stage: list[Model]
) -> list[Model]:
    """Puts the effect with the fewest parameters first among those that tie."""
    if not stage:
        return stage
    samples = problem.samples
    gains = {m.effects: log_likelihood_gain(smaller, m, samples) for m in stage}
    most, best = gains[stage[0].effects], stage[0].effects[-1]

    def tie(m: Model) -> bool:
        behind = most - gains[m.effects]
        if best not in NESTED.get(m.effects[-1], ()):
            return behind < max(3.0, MODEL_ERROR * most)
        # The model error of large friction is no sign that it falls with speed.
        lacks = log_likelihood_gain(m, stage[0], samples)
        return behind < max(3.0, NESTED_SHARE * most) or lacks < MODEL_ERROR * most

    tied = [m for m in stage if tie(m)]
    first = min(
        tied, key=lambda m: (len(problem.space.of(m.effects[-1])), -gains[m.effects])
    )
    return [first, *(m for m in stage if m is not first)]
