"""Causes with their parameters and intervals, joined over the joints they act on."""

from collections.abc import Sequence

import numpy as np

from sysid.diagnosis.search.candidate import Model
from sysid.diagnosis.search.coupling import EFFECT as COUPLING
from sysid.diagnosis.search.intervals import standard_errors
from sysid.diagnosis.search.parameters import Slot
from sysid.diagnosis.search.search import Examined, Search
from sysid.diagnosis.verdict.shared import combined, disagree, sharing
from sysid.mechanism import Mechanism
from sysid.result import Cause, Estimate

HALF_WIDTH = 2.5
"""Half the width of a 95 % interval in standard errors; measured on other hidden
cases: models are not exact, and the normal 1.96 is too narrow."""


def causes_of(searched: Sequence[Examined], mechanism: Mechanism) -> list[Cause]:
    """Joins the causes of all joints by effect, in order of gain."""
    by_effect: dict[str, list[Examined]] = {}
    for e in searched:
        for effect in e.found.best.effects:
            by_effect.setdefault(effect, []).append(e)
    causes = []
    for effect, members in by_effect.items():
        for where, chosen in _places(effect, members, mechanism, searched):
            gain = sum(evidence(e.found, effect) for e in chosen)
            other = chosen[0].track.other if effect == COUPLING else ""
            each = [estimates(e.found, e.found.best, effect) for e in chosen]
            several = len(chosen) > 1
            one = several and len(sharing(effect, _names(chosen), mechanism)) == 1
            size = combined(each, HALF_WIDTH) if one else _spanned(each)
            causes.append(Cause(effect, where, size, gain, other))
    return sorted(causes, key=lambda c: -c.evidence)


def evidence(found: Search, effect: str) -> float:
    """Log-likelihood gain of the best model over the one without the effect."""
    return round(found.gain(effect), 3)


def _names(members: Sequence[Examined]) -> tuple[str, ...]:
    return tuple(e.track.joint for e in members)


def _places(
    effect: str,
    members: Sequence[Examined],
    mechanism: Mechanism,
    searched: Sequence[Examined],
) -> list[tuple[str, list[Examined]]]:
    """Returns where an effect is: the joints of one body, a class, or each joint."""
    joints, present = _names(members), set(_names(searched))
    by_name = dict(zip(joints, members, strict=True))
    one = [[by_name[j] for j in g] for g in sharing(effect, joints, mechanism)]
    each = [[e] for e in members]
    if effect == COUPLING or (one != each and any(_apart(effect, g) for g in one)):
        groups = each  # each has another joint that pulls, or a size of its own
    elif one != each or len(present) == 1:
        groups = one
    else:
        known = [("all", tuple(present)), *mechanism.classes.items()]
        for name, others in known:
            inside = present.intersection(others)
            if len(inside) > 1 and set(joints) == inside:
                return [(name, list(members))]
        groups = each
    whole = len(present) > 1 and len(groups) == 1 and len(groups[0]) == len(present)
    return [("all" if whole else " and ".join(_names(g)), g) for g in groups]


def _apart(effect: str, members: Sequence[Examined]) -> bool:
    """Whether joints that should feel one body disagree about it."""
    each = [estimates(e.found, e.found.best, effect) for e in members]
    return len(each) > 1 and disagree(each, HALF_WIDTH)


def _spanned(each: Sequence[dict[str, Estimate]]) -> dict[str, Estimate]:
    """Mean of the joints' estimates, with an interval that holds them all."""
    pooled = {}
    for name, one in each[0].items():
        values = [x[name] for x in each]
        pooled[name] = Estimate(
            float(np.mean([v.value for v in values])),
            min(v.low for v in values),
            max(v.high for v in values),
            one.unit,
        )
    return pooled


def estimates(found: Search, model: Model, effect: str) -> dict[str, Estimate]:
    """Returns the parameters of an effect with their 95 % intervals."""
    space, theta = found.problem.space, model.fit.theta
    sigma = standard_errors(found.problem, model, found.samples)
    return {
        space.slots[i].name: _interval(space.slots[i], theta[i], HALF_WIDTH * sigma[i])
        for i in space.of(effect)
    }


def _interval(slot: Slot, u: float, half: float) -> Estimate:
    """Turns an interval of the coordinate into one of the parameter."""
    ends = [float(slot.value(np.array(x))) for x in (u - half, u + half)]
    value = float(slot.value(np.array(u)))
    low, high = min(ends), max(ends)
    if slot.kind == "linear" and slot.low == 0.0:
        low = max(low, 0.0)
    big = 1e9
    return Estimate(min(value, big), min(low, big), min(high, big), slot.unit)
