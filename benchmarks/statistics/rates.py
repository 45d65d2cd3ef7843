"""Rates over many studies: coverage of intervals, false positives, power."""

import numpy as np
from scipy.stats import permutation_test

from benchmarks.statistics.shapes import SHAPES, Shape, study
from fingers_mjx.studies.statistics.intervals import (
    bca_interval,
    interquartile_mean,
    t_interval,
)
from fingers_mjx.studies.statistics.power import ALPHA, detectable
from fingers_mjx.studies.statistics.significance import holm, paired_p

LARGE = (1000, 1000)
"""Draws that stand for a population."""


def coverage(shape: Shape, n: int, studies: int, seed: int) -> dict[str, float]:
    """Share of studies whose 95 % interval has the truth in it: [low ≤ θ ≤ high] [1].

    Args:
        shape: distribution of the arms.
        n: seeds in each study.
        studies: how many are drawn.
        seed: of the draws.

    Returns:
        By interval: `t` and `bca` of the mean difference, `iqm` of our arm.
    """
    rng = np.random.default_rng(seed)
    ours, other = study(rng, studies, n, (shape.ours, shape.other))
    (population,) = study(rng, *LARGE, (shape.ours,))
    middle = float(interquartile_mean(population.ravel()))
    found = {
        "t": (t_interval(ours - other), shape.truth),
        "bca": (bca_interval(ours - other), shape.truth),
        "iqm": (bca_interval(ours, interquartile_mean), middle),
    }
    return {
        name: float(np.mean((low <= truth) & (truth <= high)))
        for name, ((low, high), truth) in found.items()
    }


def false_positives(shape: Shape, n: int, studies: int, seed: int) -> dict[str, float]:
    """Share of studies of two equal arms with p ≤ 5 %, of two tests [1].

    Args:
        shape: distribution of the arms, both `ours`.
        n: seeds in each study.
        studies: how many are drawn.
        seed: of the draws.

    Returns:
        `t`, the paired t test, and `signs`, all permutations of signs.
    """
    rng = np.random.default_rng(seed)
    ours, other = study(rng, studies, n, (shape.ours, shape.ours))
    signs = permutation_test(
        (ours, other),
        lambda x, y, axis: np.mean(x - y, axis=axis),
        permutation_type="samples",
        vectorized=True,
        n_resamples=2**n,
        batch=64,
        axis=-1,
    )
    p = {"t": paired_p(ours - other), "signs": np.asarray(signs.pvalue)}
    return {name: float(np.mean(value <= ALPHA)) for name, value in p.items()}


def family(effects: tuple[float, ...], n: int, studies: int, seed: int) -> dict:
    """Share of studies with a false rejection among comparisons with one baseline [1].

    Args:
        effects: true difference of each arm from the baseline, in its noise; the
            false rejections are those among the zeros.
        n: seeds in each study.
        studies: how many are drawn.
        seed: of the draws.

    Returns:
        `holm` and, as the negative control, `alone`, without correction.
    """
    rng = np.random.default_rng(seed)
    draw = SHAPES["normal"].ours
    baseline, *arms = study(rng, studies, n, (draw, *[draw] * len(effects)))
    moved = np.stack(arms, axis=1) + np.reshape(effects, (-1, 1))
    p = paired_p(moved - baseline[:, None])
    null = np.array(effects) == 0
    corrected = np.array([holm(one) for one in p])
    return {
        name: float(np.mean((value[:, null] <= ALPHA).any(axis=1)))
        for name, value in {"holm": corrected, "alone": p}.items()
    }


def power(n: int, studies: int, seed: int) -> dict[str, float]:
    """Share of studies that find the difference called detectable, p ≤ 5 % [1].

    Args:
        n: seeds in each study.
        studies: how many are drawn.
        seed: of the draws.

    Returns:
        `at` that difference, `half` as large, and `low` and `high`, the central 95 %
        of what studies call detectable, relative to what it is.
    """
    rng = np.random.default_rng(seed)
    difference = rng.normal(size=(studies, n))
    smallest = detectable(1.0, n)
    found = {
        name: float(np.mean(paired_p(difference + factor * smallest) <= ALPHA))
        for name, factor in (("at", 1.0), ("half", 0.5))
    }
    said = difference.std(axis=-1, ddof=1)
    low, high = np.percentile(said, (2.5, 97.5))
    return {**found, "low": float(low), "high": float(high)}
