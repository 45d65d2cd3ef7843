"""Selection of nested models: what an effect must gain, and in which residual.

A larger model is accepted if its log-likelihood gain on held-out folds exceeds a
threshold and it removes enough of the error of the residual in which it acts.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.fits.candidate import (
    Model,
    heldout_gain,
    log_likelihood_gain,
    off_prior,
)
from sysid.diagnosis.fits.grids import chance_gain
from sysid.diagnosis.fits.intervals import timing_error
from sysid.diagnosis.fits.problem import Problem

LEAST_SHARE = 0.03
"""Least share of the held-out error above noise that a cause must remove."""

PLAUSIBLE_SD = 5.0
"""Prior standard deviations from nominal up to which a parameter is plausible."""

SURE = 1.96
"""Standard errors by a servo's cycle that a time must be away from none."""

MODEL_ERROR = 0.003
"""Share of a gain that does not decide between two effects: no equation is exact."""

THRESHOLD = 12.0
"""Least log-likelihood gain of a cause."""

NOMINAL_THRESHOLD = 7.0
"""The same of a nominal parameter that leaves its tolerance."""

SPRING_THRESHOLD = 30.0
"""The same of a spring, which may ring at any frequency of a record: chance finds one
where effects without a frequency of their own find nothing; 19 to 20 are the most of 40
effect-free records."""


def accepted(problem: Problem, smaller: Model, larger: Model, base: Model) -> bool:
    """Whether a larger model gains enough over a smaller one that it contains."""
    gain = log_likelihood_gain(smaller, larger, problem.samples)
    added = [e for e in larger.effects if e not in smaller.effects]
    # What the equation of a large effect does not explain is not another effect.
    least = MODEL_ERROR * explained_gain(problem, smaller, larger, base)
    if all(problem.space.has_nominal(e) for e in added):
        if any(off_prior(problem, smaller, e) > PLAUSIBLE_SD for e in added):
            # It must go back to its prior, whatever noise and other effects are.
            held = heldout_gain(smaller, larger, problem.samples)
            return held > NOMINAL_THRESHOLD
        return gain > max(NOMINAL_THRESHOLD, least)
    if not plausible(problem, smaller, larger):
        return False
    threshold = threshold_of(problem, larger, added)
    removes = _removes_enough(problem, smaller, larger, base)
    return gain > max(threshold, least) and removes


def plausible(problem: Problem, smaller: Model, larger: Model) -> bool:
    """Whether what a larger model adds can be, however much it gains.

    Args:
        problem: of the joint.
        smaller: a model.
        larger: one with effects more.
    """
    added = [e for e in larger.effects if e not in smaller.effects]
    if any(_within_cycle(problem, larger, e) for e in added):
        return False
    friction = "load_friction" in added
    return not friction or _predicts_effort(problem, smaller, larger)


def threshold_of(problem: Problem, model: Model, added: Sequence[str]) -> float:
    """What effects must gain, beyond what the best of many grids gains by chance [nat].

    Args:
        problem: of the joint.
        model: a fitted model with the effects.
        added: their names.

    Source:
        Ours.
    """
    if "compliance" in added:
        return SPRING_THRESHOLD
    if "command_quantization" in added:
        return THRESHOLD + chance_gain(problem, model.fit.theta)
    return THRESHOLD


def _within_cycle(problem: Problem, model: Model, effect: str) -> bool:
    """Whether the times of an effect are no longer than a servo's own cycle may be.

    Its gain may be large nevertheless: of many rows the mean knows such times well.
    """
    slots = [(i, problem.space.slots[i]) for i in problem.space.of(effect)]
    sizes = [(model.fit.theta[i], slot) for i, slot in slots if slot.is_size]
    unsure = [timing_error(slot, float(u), problem.data) for u, slot in sizes]
    return any(unsure) and all(
        abs(u - slot.nominal) < SURE * error
        for (u, slot), error in zip(sizes, unsure, strict=True)
    )


def _predicts_effort(problem: Problem, smaller: Model, larger: Model) -> bool:
    """Whether friction that grows with the torque predicts the torque better, too.

    A share K of the drive's torque makes the residual smaller by 1 − K whatever it
    lacks, and the torque that it predicts, f / (1 − K), wrong by as much more. Where
    repeats say what is noise, the residual need not be that of the torque.
    """
    if problem.repeat or not problem.data.effort.all():
        return True
    (where, *_) = problem.space.of("load_friction")
    share = float(problem.space.slots[where].value(larger.fit.theta[where]))
    passed = max(1.0 - share, 1e-3) ** 2
    return bool(larger.errors[1] < passed * smaller.errors[1])


def _removes_enough(
    problem: Problem, smaller: Model, larger: Model, base: Model
) -> bool:
    """Whether enough of an error goes, where most of it goes.

    A large effect in one residual must not hide a small one in the other, nor one that
    nuisance parameters far off their priors hide.
    """
    k = _strongest(problem, smaller, larger)
    noise = [*problem.channel_counts(), 0.0]
    removed = _parts(problem, smaller)[k] - _parts(problem, larger)[k]
    return bool(removed > LEAST_SHARE * (_parts(problem, base)[k] - noise[k]))


def _strongest(problem: Problem, smaller: Model, larger: Model) -> int:
    """Returns the part in which most of the error goes."""
    return int(np.argmax(_parts(problem, smaller) - _parts(problem, larger)))


def explained_gain(
    problem: Problem, smaller: Model, larger: Model, base: Model
) -> float:
    """Log-likelihood gain of a smaller model where a larger one gains most.

    What nuisance parameters take up off their priors may come from either residual.
    """
    gained = _parts(problem, base) - _parts(problem, smaller)
    k = _strongest(problem, smaller, larger)
    return 0.5 * float(gained.sum() if k == len(gained) - 1 else gained[k])


def _parts(problem: Problem, model: Model) -> Float[np.ndarray, "3"]:
    """Returns the squared errors of both residuals, and the penalty of the priors."""
    return np.append(problem.channel_counts() * model.errors, model.penalty)
