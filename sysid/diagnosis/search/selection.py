"""Is a larger model worth its effect? What a cause must add, and where it counts."""

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.search.candidate import Model, bent, error_nat, gain_nat
from sysid.diagnosis.search.problem import CHANNELS, Problem

LEAST_SHARE = 0.03
"""Least share of the held-out error above noise that a cause must remove."""

BELIEVED = 5.0
"""Prior deviations from its figure up to which a nuisance is believed."""

ALIKE = 0.003
"""Share of a gain that does not decide between two effects."""

THRESHOLD = 18.0
"""Least gain of a cause in the logarithm of the predictive density [nat]."""

FIGURE_THRESHOLD = 7.0
"""The same of a figure that the simulation has and that leaves its tolerance [nat]."""

SPRING_THRESHOLD = 30.0
"""The same of a spring, which may ring at any frequency of a record: chance finds one
where effects without a frequency of their own find nothing; 19 to 20 nat are the most
of 40 effect-free records [nat]."""


def worth(problem: Problem, smaller: Model, larger: Model, base: Model) -> bool:
    """Tells whether a larger model is worth its effect."""
    samples = int(problem.counts().sum())
    gain = gain_nat(smaller, larger, samples)
    added = [e for e in larger.effects if e not in smaller.effects]
    # What an equation leaves of a large effect is not another effect.
    least = ALIKE * told(problem, smaller, larger, base)
    if all(problem.space.figured(e) for e in added):
        if any(bent(problem, smaller, e) > BELIEVED for e in added):
            # That the figure straightens is no matter of noise or of other effects.
            return error_nat(smaller, larger, samples) > FIGURE_THRESHOLD
        return gain > max(FIGURE_THRESHOLD, least)
    threshold = SPRING_THRESHOLD if "compliance" in added else THRESHOLD
    return gain > max(threshold, least) and _shares(problem, smaller, larger, base)


def _shares(problem: Problem, smaller: Model, larger: Model, base: Model) -> bool:
    """Tells whether enough of an error goes, where most of it goes.

    A large effect in one residual must not hide a small one in the other, nor one that
    the figures hide by bending out of their tolerances.
    """
    k = _strongest(problem, smaller, larger)
    noise = [*problem.counts().reshape(2, -1).sum(1), 0.0]
    removed = _parts(problem, smaller)[k] - _parts(problem, larger)[k]
    return bool(removed > LEAST_SHARE * (_parts(problem, base)[k] - noise[k]))


def _strongest(problem: Problem, smaller: Model, larger: Model) -> int:
    """Returns the part in which most of the error goes."""
    return int(np.argmax(_parts(problem, smaller) - _parts(problem, larger)))


def told(problem: Problem, smaller: Model, larger: Model, base: Model) -> float:
    """Returns what a smaller model gains [nat] where a larger one gains most.

    What figures take up by bending may come from either residual.
    """
    gained = _parts(problem, base) - _parts(problem, smaller)
    k = _strongest(problem, smaller, larger)
    return 0.5 * float(gained.sum() if k == len(CHANNELS) else gained[k])


def _parts(problem: Problem, model: Model) -> Float[np.ndarray, "3"]:
    """Returns the squared errors of both residuals, and of the figures."""
    counts = problem.counts().reshape(2, -1).sum(1)
    return np.append(counts * model.errors, model.penalty)
