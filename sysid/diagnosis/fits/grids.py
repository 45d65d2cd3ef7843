"""Grids of targets from which fits of a rounded command begin.

Rounding errors of two grids are unlike as soon as the largest target lies half a grid
apart, so the error of a fit has an optimum for every grid, each as narrow as that. All
are tried, down to the finest that could gain anything.
"""

from functools import partial

import numpy as np
from jaxtyping import Float
from scipy.signal import lfilter

from sysid.diagnosis.fits.lanes import LANES
from sysid.diagnosis.fits.parameters import Slot
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.replay.band import EVERY, TAPS
from sysid.diagnosis.side_by_side import side_by_side

MOST_GRIDS = 6e7
"""Largest number of grids that are tried, times that of the targets."""

OPTIMA = 16
"""Number of local optima of a grid whose starts are tried in the whole chain."""

APART = 0.125
"""How much further the largest target goes from one grid to the next [grids]."""

FAINT = 12.0
"""Log-likelihood that the finest grid gains whose rounding is looked for. Of K grids
the best gains log K by chance, which is less for all that are tried."""


def grid_optima(
    problem: Problem, origin: Float[np.ndarray, " n"], index: int
) -> Float[np.ndarray, " k"]:
    """Coordinates of grids near which the commands' optima lie, the likeliest first.

    Thousands are tried, and not in the whole chain but by the correlation of the
    residual with the rounding behind delay and low-pass.

    Args:
        problem: residuals of a joint.
        origin: coordinates to which a grid is added [1].
        index: of the grid's coordinate.

    Source:
        Ours.
    """
    slot, track = problem.space.slots[index], problem.data.track
    targets = np.asarray(track.held, float)[:, -1]
    seen = 0 if problem.valid[0].any() else 1
    grids = _grids(slot, targets, _finest(problem, seen))
    values, _ = problem.space.values(origin[None])
    delay = values["transport_delay"]["delay_s"][0] / problem.data.dt
    keeps = np.exp(
        -2.0 * np.pi * values["lowpass_cutoff"]["cutoff_hz"][0] * problem.data.dt
    )
    raw = problem.raw(origin[None])
    residual = problem.whitened(raw)[0]
    gain = np.asarray(track.kp) * (2.0 * seen - 1.0) * problem.weight[seen]

    def likeness(grids: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        grid = grids[:, None, None]
        rounding = grid * np.round(targets / grid) - targets
        smooth = np.asarray(lfilter([1.0 - keeps], [1.0, -keeps], rounding, axis=1))
        moved = np.zeros((len(grid), *raw.shape[1:]))
        # A target comes anywhere in the step that ends with it.
        moved[:, seen] = gain * _banded(smooth, delay + 0.5, raw.shape[2])
        shown = problem.whitened(np.where(problem.valid, moved, 0.0))
        size = np.sqrt(np.sum(shown**2, 1))
        return -shown @ residual / np.maximum(size, 1e-12)

    batches = np.split(grids, range(LANES, len(grids), LANES))
    found = side_by_side([partial(likeness, batch) for batch in batches])
    best = np.argsort(-np.concatenate(found))[:OPTIMA]
    return grids[best] / slot.scale


def chance_gain(problem: Problem, theta: Float[np.ndarray, " n"]) -> float:
    """Log K of the K grids that are no finer than that of a model [nat].

    Args:
        problem: residuals of a joint.
        theta: coordinates of the model, with a grid Δ [1].

    Source:
        The largest of s x − s² / 2 over K and every size s of an error, where x is
        normal, is about log K: what the best of K grids gains of noise alone.
    """
    (index,) = problem.space.of("command_quantization")
    step = float(problem.space.slots[index].value(theta[index]))
    largest = float(np.abs(np.asarray(problem.data.track.held)).max())
    return float(np.log1p(largest / (APART * step))) if step > 0.0 else 0.0


def _finest(problem: Problem, seen: int) -> float:
    """Δ = (σ / k_p) √(24 Λ / n), whose rounding gains Λ = n (k_p Δ)² / 24 σ² nat.

    Rounding has the variance Δ² / 12, and n residuals of the noise σ see it.
    """
    stiffness = float(np.mean(np.asarray(problem.data.track.kp)))
    count = max(int(problem.channel_counts()[seen]), 1)
    noise = problem.noise[seen].deviation
    return noise / stiffness * float(np.sqrt(24.0 * FAINT / count))


def _grids(slot: Slot, targets: np.ndarray, finest: float) -> Float[np.ndarray, " k"]:
    """Grids between which the largest target u goes an eighth of a grid further.

    Grids Δ and Δ' agree on it while |u / Δ − u / Δ'| is well below ½. Where all down to
    the finest would be too many, the last ones are left out.
    """
    coarse, fine = (1.0 / (slot.scale * u) for u in reversed(slot.starts))
    apart = APART / max(float(np.abs(targets).max()), 1e-12)
    most = max(MOST_GRIDS / targets.size, 1e3)
    reach = min(1.0 / finest, coarse + apart * most)
    count = (max(fine, reach) - coarse) / apart + 2.0
    return 1.0 / np.linspace(coarse, max(fine, reach), int(min(count, most)))


def _banded(x: np.ndarray, delay: float, count: int) -> Float[np.ndarray, "c m p"]:
    """Reads signals some steps earlier and passes them through the residuals' band."""
    place = np.clip(np.arange(x.shape[1]) - delay, 0.0, x.shape[1] - 1.0)
    low = np.minimum(place.astype(int), x.shape[1] - 2)
    part = (place - low)[:, None]
    late = (1.0 - part) * x[:, low] + part * x[:, low + 1]
    last = (count - 1) * EVERY + 1
    banded = np.zeros((len(x), count, x.shape[2]))
    for k, w in enumerate(TAPS.tolist()):
        banded += w * late[:, k : k + last : EVERY]
    return banded
