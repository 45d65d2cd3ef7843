"""Between effects that the equations hardly distinguish, the simulated angle decides.

An equation of means over steps explains a torque with whatever is large at the same
time; the motion that follows from it need not be that which was measured. Where one
cause was found, another effect takes its place if the angle with it is more likely by
more than the equations are less so, by a share of what the cause explains of the angle:
no simulation is exact. That must hold for the angles that a fit saw as well as for
those that it did not: where folds hardly predict each other, chance decides what is
held out. Asked are effects that explain about as much of the equations; and where these
show less of the cause than the angle does, those that the angle prefers.
"""

from dataclasses import dataclass

from sysid.diagnosis.fits.candidate import Model, fitted_gap, likelihood_gap
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.search.by_angle import nearest
from sysid.diagnosis.search.contained import plainer
from sysid.diagnosis.search.judge import TRIED, Judge
from sysid.diagnosis.search.selection import plausible, threshold_of
from sysid.diagnosis.search.stage import NESTED, NESTED_SHARE, extended

EXPLAINED = 0.5
"""Least share of a cause's gain in the equations that an effect in its place has."""


@dataclass(frozen=True)
class Decided:
    """What the angle preferred to the answer of the equations.

    Attributes:
        best: the model.
        leads: how much likelier it is than others by angle, fitted or held out,
            whichever says less, less what it is less likely by equations; by their
            effects, () for none, by angle alone [nat].
    """

    best: Model
    leads: dict[tuple[str, ...], float]


def decided_by_angle(
    judge: Judge, base: Model, best: Model, others: list[Model]
) -> Decided | None:
    """Returns what the angle prefers to a single cause, if it prefers anything.

    Args:
        judge: of the search by equations.
        base: the nominal model.
        best: the answer of the search, with one cause.
        others: models with another effect in its place, best first.
    """
    if judge.output is judge.problem or not judge.sees or len(best.effects) != 1:
        return None
    asked = _asked(judge, base, best, others)
    gain = _by_angle(judge, base, best)
    behind = {m.effects: _behind(judge, best, m) for m in asked}
    ahead = {m.effects: _by_angle(judge, best, m) - behind[m.effects] for m in asked}
    for m in sorted(asked, key=lambda m: -ahead[m.effects]):
        needed = threshold_of(judge.problem, m, m.effects)
        least = max(needed, NESTED_SHARE * gain)
        if ahead[m.effects] <= least or not judge.confirms(base, m):
            continue
        # What contains another, and shows no more than that, is no alternative either.
        asked = [o for o in asked if o is not m]
        if plainer(judge, base, m, others) is None:
            more = {o.effects: behind[o.effects] - behind[m.effects] for o in asked}
            leads = {o.effects: _by_angle(judge, o, m) + more[o.effects] for o in asked}
            leads |= {best.effects: ahead[m.effects], (): _by_angle(judge, base, m)}
            return Decided(m, leads)
    return None


def _asked(judge: Judge, base: Model, best: Model, others: list[Model]) -> list[Model]:
    """Returns the models that may be nearer."""
    problem, (cause,) = judge.problem, best.effects
    others = [m for m in others if _may_stand(problem, base, m, cause)]
    gain = likelihood_gap(base, best, problem.samples)
    if _by_angle(judge, base, best) < gain:
        least = (1.0 - EXPLAINED) * gain
        near = [m for m in others if likelihood_gap(m, best, problem.samples) < least]
        return near[:TRIED]
    stage = {m.effects: m for m in extended(judge.output, judge.moved(base))}
    for m in (best, *others):  # all alike from many starts
        if m.effects in stage:
            judge.knows(m, stage[m.effects])
    asked = {m.effects: m for m in others}
    return [asked[effects] for effects in stage if effects in asked][:TRIED]


def _may_stand(problem: Problem, base: Model, model: Model, cause: str) -> bool:
    """Whether an effect can take the place of a cause that it does not contain."""
    (effect,) = model.effects
    return effect not in NESTED.get(cause, ()) and plausible(problem, base, model)


def _by_angle(judge: Judge, worse: Model, better: Model) -> float:
    """How much likelier the angle is with a model, fitted and held out [nat]."""
    fits = nearest(judge, worse), nearest(judge, better)
    samples = judge.output.samples
    return min(likelihood_gap(*fits, samples), fitted_gap(*fits, samples))


def _behind(judge: Judge, best: Model, other: Model) -> float:
    """How much less likely another model is by equations [nat]."""
    return max(0.0, likelihood_gap(other, best, judge.problem.samples))
