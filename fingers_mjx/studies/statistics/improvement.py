"""Probability of improvement: how often one arm is above the other."""

import numpy as np
from jaxtyping import Float


def probability_of_improvement(
    ours: Float[np.ndarray, " n"], other: Float[np.ndarray, " m"]
) -> float:
    """P = Σ_i Σ_j ([x_i > y_j] + ½ [x_i = y_j]) / (n m), from 0 to 1 [1].

    Chance that a training of our arm, with any seed, is above one of the other arm with
    any seed: all pairs of seeds count, not only equal seeds. ½ is no difference; it is
    the statistic of Mann and Whitney over n m. For a measure of which less is better,
    swap the arms. NaN without values.

    Args:
        ours: one value per seed.
        other: one value per seed of the arm that it is compared with.

    Source:
        Agarwal et al., "Deep Reinforcement Learning at the Edge of the Statistical
        Precipice", NeurIPS, 2021 ("probability of improvement", for one task).
    """
    if not (len(ours) and len(other)):
        return np.nan
    x, y = ours[:, None], other[None, :]
    return float(np.mean((x > y) + 0.5 * (x == y)))
