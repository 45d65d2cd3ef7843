"""Candidates are evaluated in batches of two sizes, for which programs are compiled."""

from collections.abc import Iterator

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Shaped

LANES = 64
"""Number of candidates that are evaluated at once."""

FEW_LANES = 16
"""The same where there are only a few: it takes about half as long as `LANES`."""

Batch = tuple[Shaped[np.ndarray, "l ..."], int]
"""Candidates, and how many of them are asked for."""


def in_lanes(
    candidates: Shaped[np.ndarray, "c ..."], most: int = LANES
) -> Iterator[Batch]:
    """Yields batches of one size, the last filled up with its first candidate.

    Of one size, since two programs agree to the last digit but one, and slopes are
    quotients of differences.

    Args:
        candidates: their coordinates [1], or their numbers.
        most: size of a batch of many.
    """
    lanes = FEW_LANES if len(candidates) <= 2 * FEW_LANES else most
    for first in range(0, len(candidates), lanes):
        some = candidates[first : first + lanes]
        filled = np.repeat(some[:1], lanes - len(some), 0)
        yield np.concatenate([some, filled]), len(some)


def lanes_first(found: Float[Array, "... c"]) -> Float[Array, "c ..."]:
    """Puts candidates in front, one after the other: within a program.

    NumPy takes as long for it as the program for all else.

    Args:
        found: results of a batch, its candidates last.
    """
    return jnp.moveaxis(found, -1, 0)
