"""Folds of the cross-validation."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from sysid.diagnosis.likelihood.repeats import Repeats
from sysid.diagnosis.replay.band import EVERY
from sysid.diagnosis.replay.motion import JointTrack
from sysid.logs.log import MeasuredLog

FOLDS = 3
"""Number of folds of one record, and of several."""

BLOCK_S = 1.0
"""Length of the blocks that are dealt out to folds, while errors are in many [s]."""

SHORTEST_S = 0.1
"""Least length of those blocks [s]."""

MOST_IN_FOLD = 0.8
"""Share of the squared error beyond noise that one fold may hold. A limit that one move
alone meets is not known without that move, and what is predicted of it then is wrong
however true the limit is; of parts of the move each is predicted from the others. Noise
is in all folds alike, and would hide that in a long record."""


def folds_of(
    data: JointTrack, logs: Sequence[MeasuredLog], repeats: Repeats
) -> Int[np.ndarray, "m p"]:
    """Divides the samples into folds g: by setting or load, by record, or by time.

    By time, block b = ⌊t / `BLOCK_S`⌋ belongs to fold g = b mod `FOLDS`.

    Args:
        data: the joint's track.
        logs: the records.
        repeats: of the motion; those of a block stay together.

    Returns:
        Fold of every sample [1].

    Source:
        Blocks of time keep correlated samples in one fold: P. Burman, E. Chow and D.
        Nolan, A cross-validatory method for dependent data, 1994.
    """
    m = len(data.valid)
    each = _kinds(data, logs)
    kinds = sorted(set(each))
    if len(kinds) > 1:
        return np.tile([kinds.index(kind) % 2 for kind in each], (m, 1))
    records = sorted(set(data.log.tolist()))
    if len(records) > 1:
        return np.tile([records.index(i) % FOLDS for i in data.log], (m, 1))
    return _in_time(data, repeats, BLOCK_S)


def stay_whole(data: JointTrack, logs: Sequence[MeasuredLog]) -> bool:
    """Whether folds are settings of the controller or loads, which stay whole."""
    return len(set(_kinds(data, logs))) > 1


def _kinds(data: JointTrack, logs: Sequence[MeasuredLog]) -> list[tuple]:
    """Returns load and settings of each piece."""
    headers = [logs[i].header for i in data.log]
    return [(h.load.mass_kg, tuple(sorted(h.settings.items()))) for h in headers]


def shorter_blocks(
    data: JointTrack,
    repeats: Repeats,
    fold: Int[np.ndarray, "m p"],
    excess: Float[np.ndarray, "m p"],
) -> tuple[Int[np.ndarray, "m p"], float]:
    """Shortens blocks of time until no fold holds nearly all of an error.

    A record if there are several, else a second, halved while one fold holds more than
    `MOST_IN_FOLD` of Σ_g max(x_g, 0) with the excess x_g = Σ_{t ∈ g} (e_t² − s²).

    Args:
        data: the joint's track.
        repeats: of the motion.
        fold: of `folds_of`, by record or by time.
        excess: squared error of the nominal simulation less that of the noise [1].

    Returns:
        Folds [1] and the length of their blocks, at least `SHORTEST_S` [s].

    Source:
        Ours.
    """
    length = BLOCK_S
    if _largest_share(fold, excess) > MOST_IN_FOLD:
        fold = _in_time(data, repeats, length)
    while length > 2.0 * SHORTEST_S and _largest_share(fold, excess) > MOST_IN_FOLD:
        length *= 0.5
        fold = _in_time(data, repeats, length)
    return fold, length


def _largest_share(fold: np.ndarray, excess: np.ndarray) -> float:
    """Returns the share of the excess in the fold that has most of it."""
    power = np.maximum(np.bincount(fold.ravel(), excess.ravel(), FOLDS), 0.0)
    return float(power.max() / max(power.sum(), 1e-300))


def _in_time(
    data: JointTrack, repeats: Repeats, length: float
) -> Int[np.ndarray, "m p"]:
    """Deals out blocks of time in turn."""
    seconds = EVERY * data.dt * repeats.root + data.start_s[repeats.root_piece]
    return (seconds // length).astype(int) % FOLDS
