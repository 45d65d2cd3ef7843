"""Repeats of a motion in time: what a drifting clock makes of them is no noise.

Residuals of two runs of a motion differ by noise alone, whatever the model, as long as
the mechanism is the same. A clock that drifts reads each run a little later than the
one before: that difference is of an effect, and as noise it would hide the effect.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.fits.problem import Problem

SHIFT_S = 5e-4
"""Time by which a drift that is tried moves the end of a record [s]."""

SURE = 4.0
"""Standard errors beyond which a drift is no accident of noise."""

ROUNDS = 3
"""Most steps to the drift; a large one bends the residual."""


@dataclass(frozen=True, eq=False)
class _Line:
    """How repeats differ, along the drift of the clock, and by how much it is off.

    Attributes:
        left: Σ (d / σ)² of all differences.
        step: drift with which it would be least [steps that were tried].
        sigma: standard error of that [the same].
    """

    left: float
    step: float
    sigma: float


def without_drift(
    problem: Problem, theta: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "2 m p"]:
    """Residuals r(θ, d̂) with the drift d̂ = argmin Σ ((r − r') / σ)² of the repeats.

    Args:
        problem: residuals of a joint, whose noise is to be found.
        theta: coordinates of a candidate, in units of their scales [1].

    Returns:
        Both residuals without weights, in their unit; those of the candidate itself
        where nothing repeats, or where its repeats are in time.

    Source:
        Ours; steps of Gauss and Newton.
    """
    where = problem.space.of("clock_drift")
    if not problem.repeat or not where:
        return problem.raw(theta[None], weigh=False)[0]
    slot = problem.space.slots[where[0]]
    duration_s = len(problem.data.track.cmd) * problem.data.dt
    by = np.zeros(len(theta))
    by[where[0]] = slot.coordinate(1e6 * SHIFT_S / duration_s)
    raw, tried = problem.raw(np.stack([theta, theta + by]), weigh=False)
    scale = _apart(problem, raw, np.ones(2))
    scale = np.array([max(float(np.std(d)), 1e-300) if d.size else 1.0 for d in scale])
    line = _along(problem, raw, tried, scale)
    for _ in range(ROUNDS):
        if abs(line.step) < SURE * line.sigma:
            break
        theta = theta + line.step * by
        nearer, tried = problem.raw(np.stack([theta, theta + by]), weigh=False)
        again = _along(problem, nearer, tried, scale)
        if not again.left < line.left:
            break
        raw, line = nearer, again
    return raw


def _along(problem: Problem, raw: np.ndarray, tried: np.ndarray, scale) -> _Line:
    """Fits the differences of repeats by what a drift makes of them."""
    d = np.concatenate(_apart(problem, raw, scale))
    slope = np.concatenate(_apart(problem, tried, scale)) - d
    power = max(float(slope @ slope), 1e-300)
    return _Line(float(d @ d), -float(slope @ d) / power, power**-0.5)


def _apart(problem: Problem, raw: np.ndarray, scale) -> list[np.ndarray]:
    """Returns the differences of repeats of both residuals, (r − r') / √2 σ."""
    both = [problem.differences(r, v) for r, v in zip(raw, problem.valid, strict=True)]
    return [d[valid] / s for (d, valid), s in zip(both, scale, strict=True)]
