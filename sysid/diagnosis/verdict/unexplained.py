"""What is left although causes are named: signs that none of them is the truth.

An effect that is the cause takes its own error away, from every residual, at figures
that the joint can have. A wrong one that comes near

- leaves an error that is common to the repeats,
- asks for a parameter beyond the range of the effect, or
- bends figures of the simulation far out of their tolerances.

What happens now and then, and not again when the motion is repeated, passes for noise;
but noise of readings has no samples far out: on 36 effect-free records none lies beyond
6.5 deviations. Where an effect is named, sticking that ends a little earlier in one
repeat than in the next is no news to the mechanics; the controller does not stick.
"""

import numpy as np

from envs.actuator.catalogue import CATALOGUE
from sysid.diagnosis.search.candidate import gain_nat
from sysid.diagnosis.search.parameters import Slot
from sysid.diagnosis.search.problem import CHANNELS, Problem
from sysid.diagnosis.search.search import EXCESS, Search
from sysid.diagnosis.search.selection import ALIKE, BELIEVED

LEFT = 0.2
"""Share of the removable squared error that a whole explanation may leave: its equation
is right to half of its trace. A friction that falls with speed leaves 0.17 about its
reversals, a slack cable behind shifted loads 0.15 to 0.9."""

FAR = 8.0
"""Deviations of the noise that no sample of it reaches."""

LOUD = 3.0
"""Deviations of the noise as it was before a cause was found, that a jump exceeds too:
beside a cause that takes nearly all away, steps of an encoder are jumps."""


def left_over(found: Search) -> list[str]:
    """Tells what speaks for something that no named effect explains."""
    joint = found.problem.data.joint
    texts = [*_remaining(found), *_beyond(found), *_bent(found), *_irregular(found)]
    return [f"{joint}: {text}" for text in texts]


def _remaining(found: Search) -> list[str]:
    """Finds residuals with much more than noise."""
    texts = []
    for k, name in enumerate(CHANNELS):
        before, after = found.base.errors[k], found.best.errors[k]
        if after > EXCESS and after - 1.0 > LEFT * (before - 1.0):
            times = np.sqrt(after)
            texts.append(f"the {name} residual is {times:.1f} times the noise")
    return texts


def _beyond(found: Search) -> list[str]:
    """Finds sizes at the far end of their range."""
    slots, fit = found.problem.space.slots, found.best.fit
    return [
        f"{slots[i].effect}.{slots[i].name} met its bound"
        for i in fit.bounded
        if slots[i].effect in found.best.effects
        and _is_size(slots[i])
        and fit.theta[i] != 0.0
    ]


def _is_size(slot: Slot) -> bool:
    """Tells whether a parameter is a size of its effect, and not only its shape."""
    return CATALOGUE[slot.effect].parameters[slot.name].identity is not None


def _bent(found: Search) -> list[str]:
    """Finds figures that the causes need elsewhere.

    What the equation of a large effect leaves may bend one that belongs to no effect.
    """
    slots, best = found.problem.space.slots, found.best
    texts, least = [], ALIKE * gain_nat(found.base, best, found.samples)
    for i in best.fit.free if best.effects else ():
        slot = slots[i]
        if slot.effect in best.effects or not np.isfinite(slot.tight):
            continue
        away = abs(best.fit.theta[i] - slot.base) / slot.tight
        if away > BELIEVED and (slot.effect or 0.5 * away**2 > least):
            name = f"{slot.effect}.{slot.name}".lstrip(".")
            texts.append(f"{name} lies {away:.0f} deviations from its figure")
    return texts


def _irregular(found: Search) -> list[str]:
    """Finds what repeats of the motion do not repeat."""
    problem = found.problem
    if not problem.repeat:
        return []
    raw = problem.raw(found.best.fit.theta[None])[0]
    texts = []
    for k, name in enumerate(CHANNELS):
        sticks = name == "mechanics" and found.best.effects
        if not sticks and _jumps(problem, raw[k], k):
            texts.append(f"the {name} residual has jumps that do not repeat")
    return texts


def _jumps(problem: Problem, raw: np.ndarray, k: int) -> bool:
    """Tells whether repeats leave samples of a residual far out of the others."""
    series, valid = problem.differences(raw, problem.valid[k])
    if not valid.any():
        return False
    x = np.abs(series[valid])
    least = max(FAR * np.median(x) / 0.6745, LOUD * problem.noise[k].deviation)
    return bool(np.max(x) > least)
