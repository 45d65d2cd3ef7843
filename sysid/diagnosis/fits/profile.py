"""Intervals that follow the cost, where its quadratic does not.

A size that is small beside the step of a difference has a slope that is a chord's. Of a
record without an effort all torques and masses can grow together, but chords do not
show that valley: fits stop in it, and the quadratic takes it for narrow. So the fit
that gives sizes goes on with central differences, whose steps move the residual by a
few times its noise, and the ends of an interval are where the cost has risen, with all
other coordinates fitted again.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.fits.candidate import Model, task_of
from sysid.diagnosis.fits.problem import Problem
from sysid.least_squares import Task, fit_all

MOVED = 3.0
"""Norm of what a step of a difference changes in the residual, in units of its noise:
beyond it where a simulation is not smooth, and within it where it bends."""

LARGEST = (0.1, 0.25)
"""Largest step of a difference: of a coordinate, and as a share of a size."""

LEAST = 1e-6
"""Least step of a difference; single precision shows no less."""

REACHES = (1.0, 2.0, 4.0, 8.0)
"""Ends that are tried, in units of what the quadratic says."""

ROUNDS = 8
"""Steps of the fit that gives sizes, and of those at its ends."""


def resolved(problem: Problem, model: Model) -> Model:
    """Goes on with J_i = (r(θ + δ_i) − r(θ − δ_i)) / 2 δ_i, δ_i ≈ c / ‖J_i‖.

    Args:
        problem: whose residuals were fitted.
        model: the fit, of any differences; its scores are kept.

    Returns:
        The fit from there on, in units of its coordinates [1].

    Source:
        Steps by what they change: F. James, M. Roos, Minuit, Computer Physics
        Communications 10(6), 1975; how much is ours.
    """
    task = _with_steps(problem, model)
    (fit,) = fit_all(problem.residual, [task], ROUNDS)
    return replace(model, fit=fit)


def profiled(
    problem: Problem,
    model: Model,
    half: Float[np.ndarray, " n"],
    wanted: list[int],
    level: float,
) -> Float[np.ndarray, "w 2"]:
    """Ends u with min C(θ | θ_i = u) = C(θ̂) + level² s², no nearer than `half`.

    Args:
        problem: whose residuals were fitted.
        model: the fit θ̂ with its slopes.
        half: half the widths of intervals by the quadratic.
        wanted: coordinates i.
        level: standard errors that make an interval.

    Returns:
        Lower and upper end of every wanted coordinate.

    Source:
        Profile likelihood: D. J. Venzon, S. H. Moolgavkar, A Method for Computing
        Profile-Likelihood-Based Confidence Intervals, Applied Statistics 37(1), 1988.
        With the slopes of the optimum (chord method) and on a line between reaches of
        √(ΔC) (D. M. Bates, D. G. Watts, Nonlinear Regression Analysis and Its
        Applications, 1988, chapter 6), which are ours.
    """
    places = [(i, side) for i in wanted for side in (-1.0, 1.0)]
    tasks = [
        _held(problem, model, i, side * reach * half[i])
        for i, side in places
        for reach in REACHES
    ]
    slopes = dict(zip(model.fit.free.tolist(), model.fit.jacobian.T, strict=True))
    fits = fit_all(problem.residual, tasks, ROUNDS, exact=0, shared=slopes)
    rise = np.maximum([f.cost - model.fit.cost for f in fits], 0.0)
    rise = np.nan_to_num(rise, nan=np.inf)  # of a simulation that diverges
    t = np.sqrt(rise / model.variance(problem.samples))
    ways = [_crossing(each, level) for each in t.reshape(-1, len(REACHES))]
    ends = [
        _moved(problem, model, i, side * way * half[i])
        for (i, side), way in zip(places, ways, strict=True)
    ]
    return np.reshape(ends, (-1, 2))


def _with_steps(problem: Problem, model: Model) -> Task:
    """Returns the fit of a model with central differences of its own."""
    task, fit = task_of(problem, model.effects, model.fit.theta), model.fit
    most, share = LARGEST
    norm = np.maximum(np.sqrt(np.sum(fit.jacobian**2, 0)), 1e-9)
    steps = np.zeros(len(fit.theta))
    steps[fit.free] = np.minimum(
        MOVED / norm, most * np.minimum(1.0, task.deviation[fit.free])
    )
    for i, slot in enumerate(problem.space.slots):
        if slot.effect in model.effects and slot.kind != "log" and fit.theta[i]:
            steps[i] = min(steps[i], max(share * abs(fit.theta[i]), LEAST))
    assert task.steps is not None  # of grids, which have many optima
    steps = np.where(task.steps > 0.0, task.steps, steps)
    return replace(task, steps=steps, central=True)


def _held(problem: Problem, model: Model, index: int, way: float) -> Task:
    """Returns the fit of all coordinates but one, which is moved."""
    task = task_of(problem, model.effects, model.fit.theta)
    start = model.fit.theta.copy()
    start[index] = _moved(problem, model, index, way)
    return replace(task, start=start, free=task.free[task.free != index], fresh=())


def _moved(problem: Problem, model: Model, index: int, way: float) -> float:
    """Returns a coordinate some way off, within its range."""
    slot = problem.space.slots[index]
    return float(np.clip(model.fit.theta[index] + way, slot.low, slot.high))


def _crossing(t: Float[np.ndarray, " r"], level: float) -> float:
    """Returns the reach at which √(ΔC / s²) is at a level, at least 1."""
    beyond = np.flatnonzero(t >= level)
    if not len(beyond):
        return REACHES[-1]
    k = int(beyond[0])
    if k == 0:
        return REACHES[0]
    share = (level - t[k - 1]) / (t[k] - t[k - 1])
    return REACHES[k - 1] + share * (REACHES[k] - REACHES[k - 1])
