"""Which effects does the simulation lack? Nested models, forward, backward, exchanged.

Every effect of the catalogue is fitted, from several starts, together with the nuisance
parameters. Models are compared by their error on folds that the fit did not see, with
the penalty of the priors of the nuisance parameters (`candidate`), so that a parameter
far off its prior is a finding and not silently absorbed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from sysid.diagnosis.fits.candidate import (
    CONVERGED,
    Model,
    fit_models,
    likelihood_gap,
    log_likelihood_gain,
)
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.replay.motion import JointTrack
from sysid.diagnosis.search.by_angle import explained, nearest, unsolved
from sysid.diagnosis.search.contained import plainer
from sysid.diagnosis.search.coupling import coupled
from sysid.diagnosis.search.decided import decided_by_angle
from sysid.diagnosis.search.exchange import MOST, exchanged, pruned, swapped
from sysid.diagnosis.search.judge import TRIED, Judge
from sysid.diagnosis.search.parts import EXCESS, in_parts
from sysid.diagnosis.search.remains import leaves_much
from sysid.diagnosis.search.selection import accepted
from sysid.diagnosis.search.settling import refitted, settled
from sysid.diagnosis.search.stage import (
    extended,
    simplest_first,
    still_accepted,
)
from sysid.diagnosis.simulated.output_error import OutputProblem, output_problem
from sysid.diagnosis.simulated.settled_output import settled_output

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
        leads: where the angle decided, how far it puts others behind the chosen model,
            by their effects [nat].
    """

    problem: Problem
    base: Model
    best: Model
    alternatives: dict[str, list[Model]]
    without: dict[str, Model]
    rejected: list[Model]
    samples: int
    judge: Judge
    leads: Mapping[tuple[str, ...], float] = field(default_factory=dict)

    def gain(self, cause: str) -> float:
        """Log-likelihood gain of the best model over that without a cause."""
        without = self.without.get(cause, self.base)
        gain = log_likelihood_gain(without, self.best, self.samples)
        return max(gain, self.leads.get(without.effects, gain))

    def behind(self, model: Model) -> float:
        """How far a model is behind the best one [nat]: by the angle, if that decided.

        What it was not asked about is no nearer than the last of those.
        """
        gap = likelihood_gap(model, self.best, self.samples)
        if not self.leads:
            return gap
        asked = self.leads.get(model.effects)
        return max(gap, min(self.leads.values())) if asked is None else asked


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
    again = _with_first(_searched(problem, base), found.best)
    return found if _loses_angle(again, found) else again


def _loses_angle(again: Search, first: Search) -> bool:
    """Whether a second search leaves much of an angle that the first answer explains.

    Noise that counts for more in the equations takes nothing from what the angle says.
    """
    judge = first.judge
    if judge.output is first.problem or not isinstance(judge.output, OutputProblem):
        return False
    base, best, last = (nearest(judge, m) for m in (first.base, first.best, again.best))
    much = leaves_much(base.errors[1], last.errors[1])
    return much and explained(base, best, last)


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
    """Searches the angle itself where the answer of the equations leaves some of it."""
    start = unsolved(found.judge, found.base, found.best, found.rejected)
    if start is None:
        return found
    again = _searched(*start)
    first = nearest(found.judge, found.best)
    return again if explained(again.base, again.best, first) else found


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
    problem, base, best = found.problem, found.base, found.best
    others = [m for models in found.alternatives.values() for m in models]
    said = decided_by_angle(found.judge, base, best, others)
    if said is not None:
        alternatives, without = swapped(problem, said.best, base)
        parts = {"alternatives": alternatives, "without": without}
        found = replace(found, best=said.best, leads=said.leads, **parts)
    kept = set(found.best.effects)
    rejected = [m for m in found.rejected if kept < set(m.effects)]
    return replace(found, rejected=rejected)


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
            plain = plainer(judge, smaller, model, better)
            if plain is None:
                return model
            rest = [m for m in better if m is not model]
            rest = simplest_first(judge.problem, smaller, rest)
            return _confirmed(judge, smaller, rest) or plain
        nearer = nearer or model
    return nearer
