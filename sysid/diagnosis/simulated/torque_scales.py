"""Where fits begin if nobody knows the gains: at several sizes of all torques at once.

A joint whose gains and inertias are all twice as large moves alike; what it weighs, or
how it rubs, alone says how large they are, if no effort was logged. Without the effect
that is missing a fit lets all torques shrink or grow until that matters least, and from
there no slope leads back: with a payload that it lacks, to gains of an eighth. So every
effect begins beside gains of several sizes, all else at its nominal value, and is
fitted with the gains alone before anything else may follow.
"""

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.fits.alone import costs, fitted_alone
from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.fits.origins import near_nominal
from sysid.diagnosis.fits.parameters import Space
from sysid.diagnosis.fits.starts import many_optima, tried
from sysid.diagnosis.simulated.output_error import OutputProblem

SCALES = tuple(np.linspace(-1.5, 1.5, 7).tolist())
"""Logarithms of what all gains are multiplied with: up to 4.5 times and to a fifth."""

GAINS = ("stiffness.scale", "damping.scale", "k_int")
"""Coordinates that are gains of a servo: multiplied alike, its torque is."""


def at_every_scale(
    problem: OutputProblem, smaller: Model, proposed: list[Model], most: int
) -> list[tuple[tuple[str, ...], Float[np.ndarray, " n"]]]:
    """Returns the effects that come nearest beside gains of any size, and where.

    Gains keep the ratio that the smaller model has, which the motion shows.

    Args:
        problem: the error of the angle.
        smaller: the model that lacks an effect, fitted to the angle.
        proposed: models with one effect more.
        most: number of effects.

    Returns:
        Sets and coordinates, the nearest first; none where an effort was logged, a gain
        is known, or an effect is found that may say how large torques are.
    """
    gains = unknown_gains(problem.space)
    if smaller.effects or problem.data.effort.any() or not gains:
        return []
    begin = [
        (scale, model.effects, start)
        for scale, origin in enumerate(origins_of(problem, smaller, gains))
        for model in proposed
        if _may_begin(problem, model.effects[-1], gains)
        for start in tried(problem, smaller, origin, model.effects[-1])
    ]
    if not begin:
        return []
    # Slopes of the smaller model, by which `best_starts` ranks, do not hold so far off.
    errors = costs(problem, [e for _, e, _ in begin], [u for *_, u in begin])
    best: dict[tuple[int, tuple[str, ...]], int] = {}
    for k in np.argsort(errors).tolist():
        best.setdefault(begin[k][:2], k)
    sets, starts = zip(*(begin[k][1:] for k in best.values()), strict=True)
    fits = fitted_alone(problem, sets, starts, gains)
    nearest: dict[tuple[str, ...], Float[np.ndarray, " n"]] = {}
    for k in np.argsort(costs(problem, sets, fits)).tolist():
        nearest.setdefault(sets[k], fits[k])
    return list(nearest.items())[:most]


def unknown_gains(space: Space) -> list[int]:
    """Returns the coordinates of the gains, the stiffness first, if none is known.

    Any that is known says how large torques are.

    Args:
        space: coordinates.
    """
    labels = [slot.label for slot in space.slots]
    gains = [labels.index(name) for name in GAINS if name in labels]
    return gains if all(np.isinf(space.slots[i].prior_sd) for i in gains) else []


def _may_begin(problem: OutputProblem, effect: str, gains: list[int]) -> bool:
    """Whether an effect is no gain itself, and has few optima."""
    own = problem.space.of(effect)
    return not set(own) & set(gains) and not many_optima(problem, effect)


def origins_of(
    problem: OutputProblem, smaller: Model, gains: list[int]
) -> list[Float[np.ndarray, " n"]]:
    """Returns coordinates beside gains of every size.

        θ_i = min(max(k + θ̂_i − θ̂_0, low_i), high_i)

    for the gains i, the first of which is 0, with the logarithm k of each factor: the
    nominal coordinate of a gain is zero. All else is as in `near_nominal`.

    Args:
        problem: the error of the angle.
        smaller: the model with θ̂, fitted to it.
        gains: indices of their coordinates.

    Source:
        Ours.
    """
    slots = [problem.space.slots[i] for i in gains]
    low, high = ([getattr(s, end) for s in slots] for end in ("low", "high"))
    apart = smaller.fit.theta[gains] - smaller.fit.theta[gains[0]]
    origins = np.tile(near_nominal(problem, smaller), (len(SCALES), 1))
    origins[:, gains] = np.clip(np.add.outer(SCALES, apart), low, high)
    return list(origins)
