"""From where the fits of an effect begin."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.fits.candidate import Model, off_prior
from sysid.diagnosis.fits.grids import grid_optima
from sysid.diagnosis.fits.origins import near_nominal
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.fits.projected import linear_costs

AROUND = (0.02, 0.002)
"""Logarithms around the best start within which local optima are searched."""

FAR_SD = 2.0
"""Prior standard deviations from nominal from which a fit goes on where it is."""


def starts_of(problem: Problem, model: Model, names: Sequence[str]) -> dict[str, list]:
    """Returns the best starts of every effect: near the model, the last from nominal.

    A start counts by the error that remains when the nuisance parameters follow it
    linearly. One that changes nothing, a limit that the record does not reach, comes
    last: it has no gradient. A parameter that is already far off its prior goes on from
    there. Effects with many optima have none from nominal. Where another valley of one
    parameter lies behind a hill, it is one start more.
    """
    result: dict[str, list] = {name: [] for name in names}
    for name in names:
        if off_prior(problem, model, name) > FAR_SD:
            result[name].append(model.fit.theta)
    fitted, nominal = model.fit.theta, near_nominal(problem, model)
    smooth = [name for name in names if not many_optima(problem, name)]
    for origin, some, count in ((fitted, names, 2), (nominal, smooth, 1)):
        for name, best in best_starts(problem, model, origin, some, count).items():
            result[name] += best[::-1]  # the best of nominal stays the last
    return result


def best_starts(
    problem: Problem,
    model: Model,
    origin: Float[np.ndarray, " n"],
    names: Sequence[str],
    count: int = 1,
) -> dict[str, list]:
    """Returns the best starts of every effect, all else as at an origin.

    Args:
        problem: residuals of a joint.
        model: whose nuisance parameters follow linearly.
        origin: coordinates to which an effect is added [1].
        names: of the effects.
        count: most starts of an effect; one more if another valley lies behind a hill,
            as play that a joint crosses freely lies behind play that it hardly notices.

    Returns:
        Starts of every effect, the best one first.
    """
    owned = [(n, t) for n in names for t in tried(problem, model, origin, n)]
    if not owned:
        return {}
    thetas = np.stack([origin, *(t for _, t in owned)])
    rest, *costs = linear_costs(problem, model, thetas)
    idle = np.isclose(costs, rest, rtol=1e-6, atol=0.0)
    result = {}
    for name in names:
        mine = [k for k, (owner, _) in enumerate(owned) if owner == name]
        few = count if len(mine) > 2 else 1
        ranked = sorted(mine, key=lambda k: (idle[k], costs[k]))
        best = ranked[:few]
        if len(problem.space.of(name)) == 1 and not many_optima(problem, name):
            low = {mine[i] for i in valleys([costs[k] for k in mine])}
            best += [k for k in ranked[few:] if k in low][:1]
        result[name] = [owned[k][1] for k in best]
    return result


def valleys(costs: Sequence[float]) -> list[int]:
    """Places that lie lower than both of their neighbours, the ends aside.

    Examples:
        >>> valleys([1.0, 2.0, 5.0, 3.0, 9.0])
        [3]
    """
    inner = range(1, len(costs) - 1)
    return [i for i in inner if costs[i] < min(costs[i - 1], costs[i + 1])]


def tried(
    problem: Problem, model: Model, origin: Float[np.ndarray, " n"], name: str
) -> list[Float[np.ndarray, " n"]]:
    """Returns the coordinates that are tried for an effect.

    Args:
        problem: residuals of a joint.
        model: whose nuisance parameters follow, where the error has many optima.
        origin: coordinates of all else [1].
        name: of the effect.

    Source:
        Ours.
    """
    if not many_optima(problem, name):
        return [_placed(origin, start) for start in problem.space.starts(name)]
    index = problem.space.of(name)[0]
    starts = [_placed(origin, {index: u}) for u in grid_optima(problem, origin, index)]
    for spread in AROUND:
        costs = linear_costs(problem, model, np.stack(starts))
        best = starts[int(np.argmin(costs))]
        for factor in np.exp(np.linspace(-spread, spread, 31)):
            theta = best.copy()
            theta[index] *= factor
            starts.append(theta)
    return starts


def _placed(origin: np.ndarray, start: dict[int, float]) -> np.ndarray:
    theta = origin.copy()
    theta[list(start)] = list(start.values())
    return theta


def many_optima(problem: Problem, name: str) -> bool:
    """Whether the error has many optima over an effect's parameter."""
    return problem.space.slots[problem.space.of(name)[0]].many_optima
