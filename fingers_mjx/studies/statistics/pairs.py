"""Pairs of seeds: what two arms have in common, and what is left out."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, eq=False)
class Pairs:
    """Values of two arms on the seeds that both define.

    Attributes:
        seeds: in increasing order.
        ours: one value per seed, in that order.
        other: the same of the arm that it is compared with.
        dropped: seeds that an arm lacks, or for which its value is not finite.
    """

    seeds: tuple[int, ...]
    ours: Float[np.ndarray, " n"]
    other: Float[np.ndarray, " n"]
    dropped: tuple[int, ...]

    @property
    def difference(self) -> Float[np.ndarray, " n"]:
        """d_i = ours_i - other_i over the seeds i, in the unit of the values."""
        return self.ours - self.other


def pair(ours: Mapping[int, float], other: Mapping[int, float]) -> Pairs:
    """Returns the seeds that both arms define; the others are dropped and counted.

    Args:
        ours: seed to value; NaN or infinity is as good as missing.
        other: the same of the arm that it is compared with.
    """
    every = sorted(ours.keys() | other.keys())
    kept = tuple(s for s in every if _defined(ours, s) and _defined(other, s))
    return Pairs(
        seeds=kept,
        ours=np.array([ours[s] for s in kept], float),
        other=np.array([other[s] for s in kept], float),
        dropped=tuple(s for s in every if s not in kept),
    )


def _defined(arm: Mapping[int, float], seed: int) -> bool:
    return math.isfinite(arm.get(seed, math.nan))
