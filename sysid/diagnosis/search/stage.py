"""One stage of the search: every effect that a model lacks is added and fitted."""

import numpy as np

from sysid.diagnosis.fits.alone import costs, fitted_alone
from sysid.diagnosis.fits.candidate import (
    CONVERGED,
    Model,
    fit_models,
    likelihood_gap,
    log_likelihood_gain,
    nearest_fits,
)
from sysid.diagnosis.fits.origins import near_nominal, with_effects
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.fits.starts import many_optima, starts_of
from sysid.diagnosis.replay.link import EFFECTS as LINK_EFFECTS
from sysid.diagnosis.search.presliding import DRY_SHARE, is_dry, repeats_friction
from sysid.diagnosis.search.selection import MODEL_ERROR, accepted
from sysid.diagnosis.simulated.output_error import OutputProblem
from sysid.diagnosis.simulated.output_starts import output_starts

REFINED = 3
"""Number of candidates whose fits are continued."""

ALONE_CONTINUED = 6
"""Number of effects that go on from where they come nearest alone, at nominal."""

OFF_PRIOR_PENALTY = 16.0
"""Penalty of nuisance parameters above which a fit is also continued from nominal."""

NESTED = {"coulomb_friction": ("stribeck_friction", "hysteresis")}
"""Effects that become another one at an end of their shape: they contain it, and are no
alternatives to it. A hysteresis that is dry friction (`presliding`) ties with it."""

NESTED_SHARE = 0.015
"""Share of a gain that does not decide between an effect and one that contains it: what
gives in dry friction before it slips is less than an encoder resolves."""


def extended(problem: Problem, model: Model) -> list[Model]:
    """Adds every effect that a model lacks, best first."""
    if not isinstance(problem, OutputProblem):
        return _extended(problem, model)
    first = _from_equations(problem, model)
    sets, starts = zip(*output_starts(problem, model, first), strict=True)
    models = fit_models(problem, sets, starts, nearest=True)
    near = models[:REFINED]
    sets, starts = [m.effects for m in near], [m.fit.theta for m in near]
    models = _best([*models, *fit_models(problem, sets, starts, rounds=CONVERGED)])
    return simplest_first(problem, model, _ordered(problem, model, models))


def _best(models: list[Model]) -> list[Model]:
    """Returns the best fit of every set of effects, nearest to the records first."""
    order = nearest_fits([m.effects for m in models], [m.fit for m in models])
    return [models[k] for k in order]


def _from_equations(problem: OutputProblem, model: Model) -> list[Model]:
    """Returns what the equations propose; they are asked once."""
    equations, effects = problem.equations, model.effects
    assert equations is not None
    if effects not in problem.stages:
        smaller = fit_models(equations, [effects], [model.fit.theta])[0]
        problem.stages[effects] = _extended(equations, smaller)
    return problem.stages[effects]


def _extended(problem: Problem, model: Model) -> list[Model]:
    """Adds every effect, by the equations."""
    names = [e for e in problem.space.effects if _fits_in(e, model.effects)]
    sets = [(*model.effects, name) for name in names]
    starts = starts_of(problem, model, names)
    jobs = [(s, t) for s, name in zip(sets, names, strict=True) for t in starts[name]]
    shared = dict(zip(model.fit.free.tolist(), model.fit.jacobian.T, strict=True))
    sets, begin = [j[0] for j in jobs], [j[1] for j in jobs]
    models = fit_models(problem, sets, begin, shared, nearest=True)
    alone = _nearest_alone(problem, model, starts)
    stage = _refined(problem, model, models, alone)
    return simplest_first(problem, model, stage)


def _nearest_alone(
    problem: Problem, model: Model, starts: dict[str, list]
) -> list[tuple[tuple[str, ...], np.ndarray]]:
    """Returns the effects that come nearest alone, all else at nominal.

    A large effect bends the smaller model's nuisance parameters far off their priors,
    and finds no way back with the slopes of there, which are shared.
    """
    if model.penalty <= OFF_PRIOR_PENALTY:
        return []
    begin = {
        (*model.effects, name): thetas[-1]
        for name, thetas in starts.items()
        if not many_optima(problem, name)
    }
    if not begin:
        return []
    sets = list(begin)
    thetas = fitted_alone(problem, sets, list(begin.values()))
    nearest = np.argsort(costs(problem, sets, thetas))[:ALONE_CONTINUED]
    return [(sets[k], thetas[k]) for k in nearest]


def _fits_in(effect: str, effects: tuple[str, ...]) -> bool:
    """Whether an effect can act with others: only one thing moves the link."""
    taken = effect in LINK_EFFECTS and any(e in LINK_EFFECTS for e in effects)
    return effect not in effects and not taken


def still_accepted(
    problem: Problem, smaller: Model, models: list[Model], base: Model
) -> list[Model]:
    """Chooses what gains over a model that was fitted again, and fits the others again.

    They may be held by the kink that it has left. Best first; of those that tie, the
    simplest.

    Args:
        problem: of the joint.
        smaller: model that was fitted again.
        models: larger ones, fitted before that.
        base: model without an effect.
    """
    kept = [m for m in models if accepted(problem, smaller, m, base)]
    lost = [m for m in models if not any(m is k for k in kept)]
    if not lost:
        return kept
    sets, origin = [m.effects for m in lost], smaller.fit.theta
    starts = [with_effects(problem, origin, m, m.effects) for m in lost]
    again = fit_models(problem, sets, starts, rounds=CONVERGED)
    kept += [m for m in again if accepted(problem, smaller, m, base)]
    return simplest_first(problem, smaller, _ordered(problem, smaller, kept))


def _refined(
    problem: Problem,
    smaller: Model,
    stage: list[Model],
    alone: list[tuple[tuple[str, ...], np.ndarray]],
) -> list[Model]:
    """Continues the fits that are nearest to the records; best first.

    Masses, loads and rotors that a large effect has moved off their priors compensate
    each other: from there every step leaves a narrow, curved valley. So those fits are
    continued from nominal too.
    """
    near = sorted(stage, key=lambda m: m.fit.cost)[:REFINED]
    ranked = _ordered(problem, smaller, stage)
    gains = [log_likelihood_gain(smaller, m, problem.samples) for m in ranked]
    far = 0.9 * max(gains, default=0.0)
    close = ranked[:REFINED]
    close += [m for m, g in list(zip(ranked, gains, strict=True))[REFINED:] if g > far]
    near += [m for m in close if m not in near]
    jobs = [(m.effects, m.fit.theta) for m in near] + alone
    jobs += [
        (m.effects, near_nominal(problem, m))
        for m in near
        if m.penalty > OFF_PRIOR_PENALTY
    ]
    sets, begin = [j[0] for j in jobs], [j[1] for j in jobs]
    models = fit_models(problem, sets, begin, rounds=CONVERGED, nearest=True)
    return _ordered(problem, smaller, _best([*models, *stage]))


def _ordered(problem: Problem, smaller: Model, stage: list[Model]) -> list[Model]:
    """Sorts candidates, that with the largest likelihood first."""
    least = min(stage, key=lambda m: m.score, default=smaller)
    return sorted(stage, key=lambda m: likelihood_gap(m, least, problem.samples))


def simplest_first(problem: Problem, smaller: Model, stage: list[Model]) -> list[Model]:
    """Puts the effect with the fewest parameters first among those that tie."""
    stage = [m for m in stage if not repeats_friction(problem, m)]
    if not stage:
        return stage
    samples = problem.samples
    most = likelihood_gap(smaller, stage[0], samples)
    tied = [
        m
        for m in stage
        if likelihood_gap(m, stage[0], samples)
        < deciding_gap(problem, m.effects[-1], stage[0], most)
    ]
    first = min(
        tied, key=lambda m: (len(problem.space.of(m.effects[-1])), tied.index(m))
    )
    return [first, *(m for m in stage if m is not first)]


def deciding_gap(problem: Problem, effect: str, best: Model, gain: float) -> float:
    """Returns what a model must be ahead of another effect to take its place [nat].

    Args:
        problem: residuals of a joint.
        effect: the other, in the place of that which the model adds last.
        best: the model.
        gain: log-likelihood gain of the model over that without the effect [nat].

    Source:
        Ours.
    """
    if effect == "coulomb_friction" and is_dry(problem, best):
        return max(3.0, DRY_SHARE * gain)
    if best.effects[-1] in NESTED.get(effect, ()):
        # The model error of large friction is no sign that it falls with speed.
        return max(3.0, NESTED_SHARE * gain)
    return max(3.0, MODEL_ERROR * gain)
