"""Effects that explain the records as well as a cause: the indistinguishable set."""

import numpy as np

from envs.actuator.catalogue import CATALOGUE
from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.search.search import Search
from sysid.diagnosis.search.selection import NOMINAL_THRESHOLD, THRESHOLD
from sysid.diagnosis.search.stage import NESTED, NESTED_SHARE
from sysid.diagnosis.verdict.causes import evidence
from sysid.result import Alternative

DISTINCT = 3.0
"""Difference of log-likelihood below which two effects are indistinguishable."""

ALIKE = 0.5
"""Half the squared distance of two predictions, in noise, below which no record of this
motion distinguishes them [1]."""


def alternatives_of(found: Search) -> tuple[Alternative, ...]:
    """Returns the alternatives of the strongest cause, and those like another one."""
    first, *others = sorted(found.best.effects, key=lambda e: -evidence(found, e))
    alike = [
        alternative
        for cause in others
        for alternative in _alternatives(found, cause)
        if not alternative.distinguishable
    ]
    return (*_alternatives(found, first), *alike)


def _alternatives(found: Search, cause: str) -> list[Alternative]:
    """Returns the effects that could stand in the place of a cause, nearest first.

    One that contains the cause at an end of its shape, as dry friction with a
    presliding range of zero, is no alternative to it.
    """
    result = []
    without = found.without.get(cause, found.base)
    gain = found.behind(without)
    for model in found.alternatives.get(cause, []):
        effect = next(e for e in model.effects if e not in found.best.effects)
        if effect in NESTED.get(cause, ()):
            continue
        gap = found.behind(model)
        least = NOMINAL_THRESHOLD if _alike(model, found.best) else DISTINCT
        distinct = gap > max(least, NESTED_SHARE * gain)
        # Chance alone gives some effects as much as a nominal value's small step.
        chance = gain - gap < THRESHOLD and not _confusable(effect, cause)
        if np.isfinite(gap) and gap < 0.9 * gain:
            shown, apart = round(gap, 3), bool(distinct or chance)
            apart = apart or not found.judge.prefers(without, model)
            result.append(Alternative(effect, shown, apart, cause))
    return sorted(result, key=lambda a: a.score_gap)[:8]


def _alike(one: Model, other: Model) -> bool:
    """Whether two models predict the same, and priors alone set them apart.

    Without an effort a servo's damping does what viscous friction does, but it has a
    tolerance.
    """
    between = one.fit.residual - other.fit.residual
    return 0.5 * float(between @ between) < ALIKE


def _confusable(one: str, other: str) -> bool:
    """Whether two effects leave like traces."""
    pair = CATALOGUE[one].confusable_with, CATALOGUE[other].confusable_with
    return other in pair[0] or one in pair[1]
