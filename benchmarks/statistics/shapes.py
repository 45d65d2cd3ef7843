"""Synthetic studies: values of two arms over seeds, whose true difference is known."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

Values = Float[np.ndarray, "studies n"]
Draw = Callable[[np.random.Generator, Values], Values]

EPISODES = 256
"""Behind one success rate."""


@dataclass(frozen=True)
class Shape:
    """How the values of two arms are distributed.

    Attributes:
        ours: draws the values of an arm, given what each seed has in common.
        other: the same of the arm that it is compared with.
        truth: mean of ours less mean of the other.
    """

    ours: Draw
    other: Draw
    truth: float


def study(
    rng: np.random.Generator, studies: int, n: int, arms: tuple[Draw, ...]
) -> list[Values]:
    """Returns x_a = f_a(level), one value for each study, seed and arm [1].

    Args:
        rng: what draws.
        studies: number of studies.
        n: seeds in each.
        arms: the distributions; twice the same for a study without a difference.

    Source:
        Ours: a seed moves both arms by a common level, which pairing takes out.
    """
    level = rng.normal(size=(studies, n))
    return [draw(rng, level) for draw in arms]


def _normal(rng: np.random.Generator, level: Values) -> Values:
    return level + 0.5 * rng.normal(size=level.shape)


def _heavy(rng: np.random.Generator, level: Values) -> Values:
    """Outliers to both sides: Student's t with three degrees of freedom."""
    return level + rng.standard_t(3, level.shape)


def _skewed(rng: np.random.Generator, level: Values) -> Values:
    """A tail to one side, skewness 1.75."""
    return level + rng.lognormal(0.0, 0.5, level.shape)


def _very_skewed(rng: np.random.Generator, level: Values) -> Values:
    """A long tail to one side, skewness 6.2."""
    return level + rng.lognormal(0.0, 1.0, level.shape)


def _success(a: float, b: float) -> Draw:
    """Success rates of many episodes; the rate of a training is Beta(a, b)."""

    def draw(rng: np.random.Generator, level: Values) -> Values:
        return rng.binomial(EPISODES, rng.beta(a, b, level.shape)) / EPISODES

    return draw


def _failing(share: float) -> Draw:
    """Trainings that reach about 0.1 or, in a share of them, nothing."""

    def draw(rng: np.random.Generator, level: Values) -> Values:
        works = rng.random(level.shape) > share
        return rng.normal(0.10, 0.01, level.shape) * works

    return draw


SHAPES = {
    "normal": Shape(_normal, _normal, 0.0),
    "heavy tails": Shape(_heavy, _normal, 0.0),
    "success rates near 1": Shape(_success(18, 2), _success(9, 3), 0.15),
    "some trainings fail": Shape(_failing(0.1), _failing(0.3), 0.02),
    "skewed": Shape(_skewed, _normal, float(np.exp(0.125))),
    "very skewed": Shape(_very_skewed, _normal, float(np.exp(0.5))),
}
"""From kind to difficult."""
