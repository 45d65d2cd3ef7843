"""Between effects that the equations hardly distinguish, the simulated angle decides.

An equation of means over steps explains a torque with whatever is large at the same
time; the motion that follows from it need not be that which was measured. Another
effect takes the place of a cause where the angle with it is more likely by more than
the equations are less so. Asked are effects that explain about as much of the
equations; and where these show less of a cause than the angle does, those that the
angle prefers.
"""

from sysid.diagnosis.fits.candidate import Model, likelihood_gap
from sysid.diagnosis.search.by_angle import nearest
from sysid.diagnosis.search.judge import TRIED, Judge
from sysid.diagnosis.search.selection import NOMINAL_THRESHOLD
from sysid.diagnosis.search.stage import NESTED, extended

EXPLAINED = 0.5
"""Least share of a cause's gain in the equations that an effect in its place has."""


def decided_by_angle(
    judge: Judge,
    best: Model,
    alternatives: dict[str, list[Model]],
    without: dict[str, Model],
) -> Model | None:
    """Returns the model that the angle prefers to the equations' answer, if one is.

    Args:
        judge: of the search by equations.
        best: its answer.
        alternatives: for each cause, models with another effect in its place.
        without: for each cause, the model without it.
    """
    if judge.output is judge.problem or not judge.sees:
        return None
    ahead = {
        m.effects: (_ahead(judge, best, m), m)
        for cause, models in alternatives.items()
        for m in _asked(judge, best, without[cause], models)
        if not set(m.effects) & set(NESTED.get(cause, ()))
        and judge.confirms(without[cause], m)
    }
    by, model = max(ahead.values(), key=lambda a: a[0], default=(0.0, best))
    return model if by > NOMINAL_THRESHOLD else None


def _asked(judge: Judge, best: Model, without: Model, models: list[Model]) -> list:
    """Returns the models that may be nearer, likeliest first."""
    samples, output = judge.problem.samples, judge.output
    gain = likelihood_gap(without, best, samples)
    behind = nearest(judge, without), nearest(judge, best)
    if likelihood_gap(*behind, output.samples) < gain:
        least = (1.0 - EXPLAINED) * gain
        return [m for m in models if likelihood_gap(m, best, samples) < least][:TRIED]
    fitted = {m.effects: m for m in models}
    stage = extended(output, judge.moved(without))
    asked = [m for m in stage if m.effects in fitted][:TRIED]
    for m in asked:
        judge.knows(fitted[m.effects], m)
    return [fitted[m.effects] for m in asked]


def _ahead(judge: Judge, best: Model, other: Model) -> float:
    """How much likelier another model is by angle than less so by equations [nat]."""
    here, there = nearest(judge, best), nearest(judge, other)
    gained = likelihood_gap(here, there, judge.output.samples)
    return gained - max(0.0, likelihood_gap(other, best, judge.problem.samples))
