"""From where the fits of an effect begin."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.signal import lfilter

from sysid.diagnosis.fits.candidate import Model, at_nominal, off_prior
from sysid.diagnosis.fits.lanes import LANES
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.replay.band import EVERY, TAPS

AROUND = (0.02, 0.002)
"""Logarithms around the best start within which local optima are searched."""

MOST_GRIDS = 6e7
"""Largest number of grids that are tried, times that of the targets."""

FAR_SD = 2.0
"""Prior standard deviations from nominal from which a fit goes on where it is."""

OPTIMA = 16
"""Number of local optima of a grid whose starts are tried in the whole chain."""


def starts_of(problem: Problem, model: Model, names: Sequence[str]) -> dict[str, list]:
    """Returns the best starts of every effect: near the model, the last from nominal.

    A start counts by the error that remains when the nuisance parameters follow it
    linearly. One that changes nothing, a limit that the record does not reach, comes
    last: it has no gradient. A parameter that is already far off its prior goes on from
    there. Effects with many optima have none from nominal.
    """
    result: dict[str, list] = {name: [] for name in names}
    for name in names:
        if off_prior(problem, model, name) > FAR_SD:
            result[name].append(model.fit.theta)
    fitted, nominal = model.fit.theta, at_nominal(problem, model)
    smooth = [name for name in names if not many_optima(problem, name)]
    for origin, some, count in ((fitted, names, 2), (nominal, smooth, 1)):
        for name, best in best_starts(problem, model, origin, some, count).items():
            result[name] += best
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
        count: most starts of an effect.
    """
    owned = [(n, t) for n in names for t in _tried(problem, model, origin, n)]
    if not owned:
        return {}
    thetas = np.stack([origin, *(t for _, t in owned)])
    rest, *costs = _linear_costs(problem, model, thetas)
    idle = np.isclose(costs, rest, rtol=1e-6, atol=0.0)
    result = {}
    for name in names:
        mine = [k for k, (owner, _) in enumerate(owned) if owner == name]
        few = count if len(mine) > 2 else 1
        best = sorted(mine, key=lambda k: (idle[k], costs[k]))[:few]
        result[name] = [owned[k][1] for k in best]
    return result


def _tried(problem: Problem, model: Model, origin: np.ndarray, name: str) -> list:
    """Returns the coordinates that are tried for an effect."""
    if not many_optima(problem, name):
        return [_placed(origin, start) for start in problem.space.starts(name)]
    index = problem.space.of(name)[0]
    starts = [_placed(origin, {index: u}) for u in _grid_optima(problem, origin, index)]
    for spread in AROUND:
        costs = _linear_costs(problem, model, np.stack(starts))
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


def _grid_optima(
    problem: Problem, origin: Float[np.ndarray, " n"], index: int
) -> Float[np.ndarray, " k"]:
    """Returns coordinates of grids near which the commands' optima lie.

    With largest target u, grids Δ and Δ' agree on it while |u / Δ − u / Δ'| is well
    below ½. So close together thousands are tried, and not in the whole chain but by
    the correlation of the residual with the rounding behind delay and low-pass.
    """
    slot, track = problem.space.slots[index], problem.data.track
    targets = np.asarray(track.held, float)[:, -1]
    ends = [slot.scale * u for u in (slot.starts[-1], slot.starts[0])]
    count = 8.0 * np.abs(targets).max() * (1.0 / ends[1] - 1.0 / ends[0]) + 2.0
    most = max(MOST_GRIDS / targets.size, 1e3)
    grids = 1.0 / np.linspace(1.0 / ends[0], 1.0 / ends[1], int(min(count, most)))
    values, _ = problem.space.values(origin[None])
    delay = values["transport_delay"]["delay_s"][0] / problem.data.dt
    keeps = np.exp(
        -2.0 * np.pi * values["lowpass_cutoff"]["cutoff_hz"][0] * problem.data.dt
    )
    raw = problem.raw(origin[None])
    residual = problem.whitened(raw)[0]
    seen = 0 if problem.valid[0].any() else 1
    gain = np.asarray(track.kp) * (2.0 * seen - 1.0) * problem.weight[seen]
    likeness = []
    for first in range(0, len(grids), LANES):
        grid = grids[first : first + LANES, None, None]
        rounding = grid * np.round(targets / grid) - targets
        smooth = np.asarray(lfilter([1.0 - keeps], [1.0, -keeps], rounding, axis=1))
        moved = np.zeros((len(grid), *raw.shape[1:]))
        # A target comes anywhere in the step that ends with it.
        moved[:, seen] = gain * _banded(smooth, delay + 0.5, raw.shape[2])
        shown = problem.whitened(np.where(problem.valid, moved, 0.0))
        size = np.sqrt(np.sum(shown**2, 1))
        likeness.append(-shown @ residual / np.maximum(size, 1e-12))
    best = np.argsort(-np.concatenate(likeness))[:OPTIMA]
    return grids[best] / slot.scale


def _banded(x: np.ndarray, delay: float, count: int) -> Float[np.ndarray, "c m p"]:
    """Reads signals some steps earlier and passes them through the residuals' band."""
    place = np.clip(np.arange(x.shape[1]) - delay, 0.0, x.shape[1] - 1.0)
    low = np.minimum(place.astype(int), x.shape[1] - 2)
    part = (place - low)[:, None]
    late = (1.0 - part) * x[:, low] + part * x[:, low + 1]
    last = (count - 1) * EVERY + 1
    parts = [w * late[:, k : k + last : EVERY] for k, w in enumerate(TAPS.tolist())]
    return np.sum(parts, 0)


def many_optima(problem: Problem, name: str) -> bool:
    """Whether the error has many optima over an effect's parameter."""
    return problem.space.slots[problem.space.of(name)[0]].many_optima


def _linear_costs(problem: Problem, model: Model, thetas: np.ndarray) -> np.ndarray:
    """Returns the errors that remain when the nuisance parameters follow linearly."""
    rs = problem.residual(thetas)
    fit, space = model.fit, problem.space
    prior_sd = space.prior_sds(model.effects)[fit.free]
    j = np.concatenate([fit.jacobian, np.diag(1.0 / prior_sd)])
    center = (thetas - space.nominal)[:, fit.free] / prior_sd
    full = np.concatenate([rs, center], 1)
    q, _ = np.linalg.qr(j)
    cost = np.sum(full**2, 1) - np.sum((full @ q) ** 2, 1)
    return np.where(np.isfinite(cost), cost, np.inf)
