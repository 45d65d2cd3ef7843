"""Causes with their parameters and intervals, joined over the joints they act on."""

from collections.abc import Sequence

import numpy as np

from sysid.diagnosis.search.coupling import EFFECT as COUPLING
from sysid.diagnosis.search.search import Examined, Search
from sysid.diagnosis.verdict.shared import combined, disagree, sharing
from sysid.diagnosis.verdict.sizes import HALF_WIDTH, sizes_of
from sysid.mechanism import Mechanism
from sysid.result import Cause, Estimate


def causes_of(searched: Sequence[Examined], mechanism: Mechanism) -> list[Cause]:
    """Joins the causes of all joints by effect, in order of gain."""
    by_effect: dict[str, list[Examined]] = {}
    sizes = {e.track.joint: sizes_of(e.found) for e in searched}
    for e in searched:
        for effect in e.found.best.effects:
            by_effect.setdefault(effect, []).append(e)
    causes = []
    for effect, members in by_effect.items():
        said = {j: sizes[j][effect] for j in _names(members)}
        for where, chosen in _places(effect, members, mechanism, searched, said):
            gain = sum(evidence(e.found, effect) for e in chosen)
            other = chosen[0].track.other if effect == COUPLING else ""
            each = [said[j] for j in _names(chosen)]
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
    said: dict[str, dict[str, Estimate]],
) -> list[tuple[str, list[Examined]]]:
    """Returns where an effect is: the joints of one body, a class, or each joint."""
    joints, present = _names(members), set(_names(searched))
    by_name = dict(zip(joints, members, strict=True))
    bodies = sharing(effect, joints, mechanism)
    one = [[by_name[j] for j in body] for body in bodies]
    each = [[e] for e in members]
    apart = any(_apart([said[j] for j in body]) for body in bodies)
    if effect == COUPLING or (one != each and apart):
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


def _apart(each: Sequence[dict[str, Estimate]]) -> bool:
    """Whether joints that should feel one body disagree about it."""
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
