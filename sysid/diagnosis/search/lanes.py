"""Candidates are evaluated in batches of one size, for which programs are compiled."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import ArrayLike, Float

LANES = 64
"""Number of candidates that are evaluated at once."""

Batch = tuple[Float[np.ndarray, "l n"], int]
"""Coordinates of candidates, and how many of them are asked for."""


def in_lanes(thetas: Float[np.ndarray, "c n"], lanes: int = LANES) -> Iterator[Batch]:
    """Yields batches of so many candidates, the last filled up with the first.

    Args:
        thetas: coordinates of candidates [1].
        lanes: number of candidates of a batch.
    """
    for first in range(0, len(thetas), lanes):
        some = thetas[first : first + lanes]
        filled = np.repeat(some[:1], lanes - len(some), 0)
        yield np.concatenate([some, filled]), len(some)


def lanes_first(found: ArrayLike, count: int) -> Float[np.ndarray, "c ..."]:
    """Returns the results of the candidates that are asked for, those in front.

    Args:
        found: results of a batch, its candidates last.
        count: number of candidates that are asked for.
    """
    return np.moveaxis(np.asarray(found, float), -1, 0)[:count]
