"""Whether one model predicts better than another, by more than chance."""

import numpy as np
from jaxtyping import Bool, Float


def t_of_blocks(
    gained: Float[np.ndarray, "m p"], counts: Bool[np.ndarray, "m p"], size: int
) -> float:
    """T = d̄ √B / s_d of the means d of what is gained over B blocks [1].

    Args:
        gained: squared error of the one less that of the other, e₀² − e₁².
        counts: where it counts; a block of which no more than half does is left out.
        size: samples of a block; errors of different ones are independent.

    Returns:
        0 of fewer than two blocks.

    Source:
        F. X. Diebold, R. S. Mariano, Comparing Predictive Accuracy, Journal of
        Business & Economic Statistics 13(3), 1995.
    """
    edges = np.arange(0, len(gained), size)
    sums = np.add.reduceat(np.where(counts, gained, 0.0), edges).ravel()
    number = np.add.reduceat(counts * 1.0, edges).ravel()
    means = sums[number > 0.5 * size] / number[number > 0.5 * size]
    if len(means) < 2:
        return 0.0
    scatter = float(np.std(means, ddof=1)) / np.sqrt(len(means))
    return float(np.mean(means)) / max(scatter, 1e-300)
