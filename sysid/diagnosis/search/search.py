"""Which effects does the simulation lack? Nested models, forward, backward, exchanged.

Every effect of the catalogue is fitted, from several starts, together with the nuisance
parameters. Models are compared by their error on folds that the fit did not see, with
the penalty of the priors of the nuisance parameters (`candidate`), so that a parameter
far off its prior is a finding and not silently absorbed.
"""

from dataclasses import dataclass, replace

from sysid.diagnosis.fits.candidate import (
    CONVERGED,
    Model,
    fit_models,
    likelihood_gap,
    log_likelihood_gain,
)
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.replay.motion import JointTrack
from sysid.diagnosis.search.by_angle import explained, unsolved
from sysid.diagnosis.search.coupling import coupled
from sysid.diagnosis.search.decided import decided_by_angle
from sysid.diagnosis.search.judge import TRIED, Judge
from sysid.diagnosis.search.parts import EXCESS, in_parts
from sysid.diagnosis.search.selection import accepted
from sysid.diagnosis.search.settling import refitted, settled
from sysid.diagnosis.search.stage import (
    NESTED_SHARE,
    deciding_gap,
    extended,
    still_accepted,
)
from sysid.diagnosis.simulated.output_error import output_problem
from sysid.diagnosis.simulated.output_starts import settled_output

MOST = 3
"""Largest number of causes."""

STRAINED = 25.0
"""Squared prior deviations of the nuisance parameters that are no accident [1]."""


@dataclass(frozen=True, eq=False)
class Search:
    """What a search found.

    Attributes:
        problem: with the final noise.
        base: the nominal model with its nuisance parameters fitted.
        best: the model that is chosen.
        alternatives: for each cause, models in which another effect takes its place,
            best first.
        without: for each cause, the model without it.
        rejected: candidates with one effect more, of the last stage, best first.
        samples: number of residuals that count.
        judge: compares the simulations of its models.
    """

    problem: Problem
    base: Model
    best: Model
    alternatives: dict[str, list[Model]]
    without: dict[str, Model]
    rejected: list[Model]
    samples: int
    judge: Judge

    def gain(self, cause: str) -> float:
        """Log-likelihood gain of the best model over that without a cause."""
        without = self.without.get(cause, self.base)
        return log_likelihood_gain(without, self.best, self.samples)


@dataclass(frozen=True, eq=False)
class Examined:
    """What was done with one joint; for verdict and report.

    Attributes:
        track: its measured motion.
        problem: residuals and weights; None for a joint that did not move.
        search: what was found; None likewise.
    """

    track: JointTrack
    problem: Problem | None
    search: Search | None

    @property
    def found(self) -> Search:
        """The search of a joint that moved."""
        assert self.search is not None
        return self.search


def search(problem: Problem) -> Search:
    """Runs the whole search on one joint.

    Without repeats it runs again with what the first result leaves as noise: if there
    are causes, or if parameters had to leave their tolerances for it. What a model errs
    by counts as white noise in the first run, and no tolerance holds against that.
    """
    problem, base = settled(problem)
    problem = coupled(problem, base)
    output = output_problem(problem)
    if output is not None:
        problem, base = settled_output(output, base)
    problem, base = in_parts(problem, base)
    found = _by_angle(_searched(problem, base))
    strained = base.penalty > STRAINED
    if problem.repeat or not (found.best.effects or strained):
        return found
    if found.problem is not problem:  # the angle decided, and does so again
        problem, base = found.problem, found.base
    problem = problem.with_remaining(problem.raw(found.best.fit.theta[None])[0])
    base = fit_models(problem, [()], [base.fit.theta])[0]
    return _with_first(_searched(problem, base), found.best)


def _with_first(again: Search, first: Model) -> Search:
    """Goes on from the first answer where a second search has lost it.

    Its starts are those of another noise, and may end in a valley beside it.
    """
    problem, base, best = again.problem, again.base, again.best
    if set(first.effects) <= set(best.effects):
        return again
    effects, theta = [first.effects], [first.fit.theta]
    kept = fit_models(problem, effects, theta, rounds=CONVERGED)[0]
    if not accepted(problem, best, kept, base):
        return again
    return _searched(problem, base, kept)


def _by_angle(found: Search) -> Search:
    """Searches the angle itself where the answer of the equations leaves much of it."""
    start = unsolved(found.judge, found.base, found.best, found.rejected)
    if start is None:
        return found
    again = _searched(*start)
    return again if explained(again.judge, again.base, again.best) else found


def _searched(problem: Problem, base: Model, known: Model | None = None) -> Search:
    """Searches at a given noise, from a model with effects that are known."""
    best, judge = known or base, Judge(problem, base)
    stage: list[Model] = []
    alternatives: dict[str, list[Model]] = {}
    for _ in range(MOST):
        stage = extended(problem, best)
        better = [m for m in stage if accepted(problem, best, m, base)]
        winner = _confirmed(judge, best, better)
        if winner is None:
            break
        again = refitted(problem, best.effects, winner.fit.theta)
        if again.fit.cost < best.fit.cost:
            better = still_accepted(problem, again, better, base)
            fresh = {m.effects: m for m in better}
            stage = [fresh.get(m.effects, m) for m in stage]
            winner = _confirmed(judge, again, better)
            if again.score < best.score:
                base = again if not best.effects else base
                best = again
            if winner is None:
                break
        best = pruned(problem, winner, base)
        if best.effects != winner.effects:
            break
        if len(best.effects) == 1:
            alternatives[best.effects[0]] = [m for m in stage if m is not winner]
    if len(best.effects) == 1 and best.effects[0] in alternatives:
        without = {best.effects[0]: base}
        if not judge.confirms(base, best):
            stage = [best, *alternatives[best.effects[0]]]
            best, alternatives, without = base, {}, {}
    else:
        best, alternatives, without = exchanged(problem, best, base, judge)
    return _decided(
        Search(
            problem, base, best, alternatives, without, stage, problem.samples, judge
        )
    )


def _decided(found: Search) -> Search:
    """Lets the angle decide between effects, and keeps what the answer lacks."""
    problem, best = found.problem, found.best
    parts = found.alternatives, found.without
    moved = decided_by_angle(found.judge, best, *parts)
    if moved is not None:
        best, parts = moved, swapped(problem, moved, found.base)
    rejected = [m for m in found.rejected if set(best.effects) < set(m.effects)]
    alternatives, without = parts
    changed = {"alternatives": alternatives, "without": without, "rejected": rejected}
    return replace(found, best=best, **changed)


def _fullest(better: list[Model]) -> Model:
    """Chooses the first effect, or one that explains the residual of the first.

    Where one moment alone excites a parameter, folds without it do not predict that
    moment, however true the parameter is.
    """
    first, full = better[0], min(better, key=lambda m: m.errors.max())
    remains, rest = first.errors.max() - 1.0, full.errors.max() - 1.0
    return full if remains > EXCESS - 1.0 and rest < 0.5 * remains else first


def _confirmed(judge: Judge, smaller: Model, better: list[Model]) -> Model | None:
    """Chooses the first effect with which the simulation comes nearer.

    If it is not much nearer with any, one that matters beside another may be there:
    what the other does is part of the error. It goes at the end if it does not.
    """
    if not better:
        return None
    first = _fullest(better)
    order = [first, *(m for m in better if m is not first)][:TRIED]
    nearer = None
    for model in (m for m in order if judge.prefers(smaller, m)):
        if judge.confirms(smaller, model):
            return model
        nearer = nearer or model
    return nearer


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
            gain = likelihood_gap(without[cause], best, samples)
            better = [
                m
                for m in stage
                if likelihood_gap(best, m, samples)
                > max(NESTED_SHARE * gain, deciding_gap(problem, cause, m, gain))
                and accepted(problem, without[cause], m, base)
                and judge.confirms(without[cause], m)
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
