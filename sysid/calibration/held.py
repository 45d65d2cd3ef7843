"""Targets of a record on the grid of its simulation."""

import numpy as np
from jaxtyping import Float


def held_means(
    t_s: Float[np.ndarray, " n"],
    values: Float[np.ndarray, " n"],
    grid: Float[np.ndarray, " m"],
    step_s: float,
) -> Float[np.ndarray, " m"]:
    """ū(t) = 1/Δt ∫ u dt from t − Δt to t, of targets u that hold until the next.

    A substep of the chain ends with what its filter makes of the target during it, and
    the joint takes that for the beginning: what counts is the substep before. Its mean,
    since targets that waited for the grid would all come late by one share of a step,
    for which a delay and with it a stiffness make up.

    Args:
        t_s: when targets are sent, none before the grid begins [s].
        values: the targets, of which the first holds before it is sent too [rad].
        grid: ends t of the substeps [s].
        step_s: Δt [s].

    Returns:
        ū of every substep [rad].

    Source:
        Ours: averaging is exact to second order for what a low-pass makes of targets.
    """
    last = max(grid[-1], t_s[-1]) + step_s
    knots = np.concatenate([[grid[0] - step_s], t_s, [last]])
    held = np.concatenate([values[:1], values])
    total = np.concatenate([[0.0], np.cumsum(np.diff(knots) * held)])
    ends = np.interp(np.append(grid[0] - step_s, grid), knots, total)
    return np.diff(ends) / step_s
