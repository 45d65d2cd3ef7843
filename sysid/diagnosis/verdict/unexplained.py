"""What remains unexplained although causes are named: signs of a wrong model.

The true effect removes its own error, from every residual, at parameters that the joint
can have. A wrong one that comes near

- leaves an error that is common to the repeats,
- needs a parameter beyond the range of the effect,
- does not bring the simulated motion nearer to the measured one, or
- moves nominal parameters of the simulation far off their priors.

What happens now and then, and not again when the motion is repeated, passes for noise;
but noise of readings has no outliers: on 36 effect-free records none lies beyond 6.5
standard deviations. Where an effect is named, sticking that ends a little earlier in
one repeat than in the next is expected of the mechanics; the controller does not stick.
"""

import numpy as np

from envs.actuator.catalogue import CATALOGUE
from sysid.diagnosis.search.candidate import log_likelihood_gain
from sysid.diagnosis.search.parameters import Slot
from sysid.diagnosis.search.problem import Problem
from sysid.diagnosis.search.search import EXCESS, Search
from sysid.diagnosis.search.selection import MODEL_ERROR, PLAUSIBLE_SD

REMAINING = 0.2
"""Share of the removable squared error that may remain of a complete explanation: its
equation is right to half of its trace. Of a friction that falls with speed 0.17 remains
about its reversals, of a slack cable behind shifted loads 0.15 to 0.9."""

OUTLIER_SD = 8.0
"""Standard deviations of the noise that no sample of it reaches."""

PRIOR_NOISE_SD = 3.0
"""Standard deviations of the noise before a cause was found that a jump exceeds too:
with a cause that removes nearly all, steps of an encoder look like jumps."""


def unexplained_signs(found: Search) -> list[str]:
    """Returns what speaks for something that no named effect explains."""
    joint = found.problem.data.joint
    texts = [
        *_remaining(found),
        *_no_nearer(found),
        *_at_bounds(found),
        *_off_prior(found),
        *_irregular(found),
    ]
    return [f"{joint}: {text}" for text in texts]


def _remaining(found: Search) -> list[str]:
    """Finds residuals with much more than noise, which repeats alone show surely."""
    texts = []
    if not found.problem.repeat:
        return texts
    for k, name in enumerate(found.problem.channels):
        before, after = found.base.errors[k], found.best.errors[k]
        if after > EXCESS and after - 1.0 > REMAINING * (before - 1.0):
            times = np.sqrt(after)
            texts.append(f"the {name} residual is {times:.1f} times the noise")
    return texts


def _no_nearer(found: Search) -> list[str]:
    """Finds causes that together do not lower the error of the simulated angle."""
    judge, causes = found.judge, found.best.effects
    if not causes or not judge.sees:
        return []
    if judge.t_value(judge.nominal(found.base), found.best) > 0.0:
        return []
    return [f"with {' and '.join(causes)} the simulated motion comes no nearer"]


def _at_bounds(found: Search) -> list[str]:
    """Finds sizes at the far end of their range."""
    slots, fit = found.problem.space.slots, found.best.fit
    return [
        f"{slots[i].label} met its bound"
        for i in fit.bounded
        if slots[i].effect in found.best.effects
        and _is_size(slots[i])
        and fit.theta[i] != 0.0
    ]


def _is_size(slot: Slot) -> bool:
    """Whether a parameter is a size of its effect, and not only its shape."""
    return CATALOGUE[slot.effect].parameters[slot.name].identity is not None


def _off_prior(found: Search) -> list[str]:
    """Finds nominal parameters that the causes need elsewhere.

    The model error of a large effect may move a parameter that belongs to no effect.
    """
    slots, best = found.problem.space.slots, found.best
    texts, least = (
        [],
        MODEL_ERROR * log_likelihood_gain(found.base, best, found.samples),
    )
    for i in best.fit.free if best.effects else ():
        slot = slots[i]
        if slot.effect in best.effects or not np.isfinite(slot.prior_sd):
            continue
        away = slot.shift(best.fit.theta[i])
        if away > PLAUSIBLE_SD and (slot.effect or 0.5 * away**2 > least):
            how_far = f"{away:.0f} prior standard deviations"
            texts.append(f"{slot.label} lies {how_far} from nominal")
    return texts


def _irregular(found: Search) -> list[str]:
    """Finds what does not recur in repeats of the motion."""
    problem = found.problem
    if not problem.repeat:
        return []
    raw = problem.raw(found.best.fit.theta[None])[0]
    texts = []
    for k, name in enumerate(problem.channels):
        sticks = name == "mechanics" and found.best.effects
        if not sticks and _jumps(problem, raw[k], k):
            texts.append(f"the {name} residual has jumps that do not repeat")
    return texts


def _jumps(problem: Problem, raw: np.ndarray, k: int) -> bool:
    """Whether the difference of repeats has outliers."""
    series, valid = problem.differences(raw, problem.valid[k])
    if not valid.any():
        return False
    x = np.abs(series[valid])
    least = max(
        OUTLIER_SD * np.median(x) / 0.6745, PRIOR_NOISE_SD * problem.noise[k].deviation
    )
    return bool(np.max(x) > least)
