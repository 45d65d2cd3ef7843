"""What the causes remove of the error on held-out folds, and the noise floor."""

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.fits.refolded import refolded
from sysid.diagnosis.fits.tolerances import within_tolerances
from sysid.diagnosis.search.search import Search
from sysid.diagnosis.simulated.output_error import OutputProblem
from sysid.result import Gain

BLOCKS = 24
"""Number of blocks of time that the bootstrap draws from."""

DRAWS = 400
"""Number of bootstrap samples."""


def residual_gains(found: Search, units: dict[str, str], seed: int) -> dict[str, Gain]:
    """Returns the gains by residual.

    Args:
        found: a search.
        units: of `position`, `controller` and `mechanics`.
        seed: of the bootstrap over blocks of time.
    """
    judge = found.judge
    # The error of the angle is the judge's own.
    angle = isinstance(found.problem, OutputProblem)
    gains = {} if angle else _equation_gains(found, units, seed)
    if judge.sees:
        before, after = (judge.error(m) for m in judge.pair(found.base, found.best))
        gains["position"] = _gain(
            found.problem, before, after, judge.valid, units["position"], seed
        )
    return gains


def _equation_gains(found: Search, units: dict[str, str], seed: int) -> dict[str, Gain]:
    problem, gains = found.problem, {}
    models = within_tolerances(problem, found.base), refolded(problem, found.best)
    for k, name in enumerate(problem.channels):
        if problem.valid[k].any():
            before, after = (_heldout(problem, m, k) for m in models)
            parts = (before, after, problem.valid[k], units[name], seed)
            gains[name] = _gain(problem, *parts)
    return gains


def _heldout(problem: Problem, model: Model, channel: int) -> Float[np.ndarray, "m p"]:
    """Residual of every sample at the parameters estimated without its fold."""
    raw = problem.raw(model.fold_theta)[:, channel]
    return np.take_along_axis(raw, problem.fold[None], 0)[0]


def _gain(problem, before, after, valid, unit, seed) -> Gain:
    """Compares two held-out errors."""
    floors = [_floor(problem, errors, valid) for errors in (before, after)]
    floor = min((f for f in floors if f is not None), default=None)
    old, new = before[valid] ** 2, after[valid] ** 2
    part = np.array_split(np.arange(old.size), min(BLOCKS, max(1, old.size // 4)))
    sums = np.array([(old[i].sum(), new[i].sum(), len(i)) for i in part])
    rng = np.random.default_rng(seed)
    draws = sums[rng.integers(0, len(sums), (DRAWS, len(sums)))].sum(1)
    shares = _explained(draws[:, 0] / draws[:, 2], draws[:, 1] / draws[:, 2], floor)
    total = sums.sum(0)
    low, high = np.percentile(shares, [2.5, 97.5])
    return Gain(
        heldout_rmse_before=float(np.sqrt(total[0] / total[2])),
        heldout_rmse_after=float(np.sqrt(total[1] / total[2])),
        explained_fraction=float(
            _explained(total[0] / total[2], total[1] / total[2], floor)
        ),
        low=float(low),
        high=float(high),
        unit=unit,
        noise_floor=floor,
    )


def _explained(before, after, floor: float | None):
    """Share of the removable variance that is removed, at most one."""
    least = 0.0 if floor is None else floor**2
    removable = np.maximum(before - least, 1e-3 * before)
    return np.minimum((before - np.maximum(after, least)) / removable, 1.0)


def _floor(problem: Problem, errors: np.ndarray, valid: np.ndarray) -> float | None:
    """Noise from repeats: what differs although the targets are the same."""
    if not problem.repeat:
        return None
    d, counts = problem.repeat.differences(errors, valid)
    return float(np.sqrt(np.mean(d[counts] ** 2))) if counts.any() else None
