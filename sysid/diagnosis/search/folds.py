"""Folds of the cross-validation, and the period after which a motion repeats."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Int

from sysid.diagnosis.replay.band import EVERY, sample_rows
from sysid.diagnosis.replay.motion import JointTrack
from sysid.logs.log import MeasuredLog

FOLDS = 3
"""Number of folds of one record, and of several."""

BLOCK_S = 1.0
"""Length of the blocks that are dealt out to folds [s]."""

ALIKE = 0.995
"""Likeness above which two stretches of the target are repeats."""


def repeat_of(data: JointTrack) -> int:
    """Returns after how many samples the target repeats itself, 0 if it does not.

    The lag of the largest likeness 1 − Σ (x − x')² / Σ (x² + x'²), if above `ALIKE`.
    """
    if data.valid.shape[1] != 1:
        return 0
    cmd = np.asarray(data.track.cmd, float)[sample_rows(len(data.track.cmd)), 0]
    known = data.valid[:, 0].astype(float)
    x = (cmd - cmd.mean()) * known
    lags = np.arange(max(8, int(2.0 / (EVERY * data.dt))), int(0.55 * len(x)))
    if not lags.size or x.std() < 1e-9:
        return 0
    # Where both readings are known: Σ (x − x')² and Σ x² + x'².
    both = _overlap(x**2, known)[lags] + _overlap(known, x**2)[lags]
    apart = both - 2.0 * _overlap(x, x)[lags]
    likeness = 1.0 - apart / np.maximum(both, 1e-30)
    best = int(np.argmax(likeness))
    return int(lags[best]) if likeness[best] > ALIKE else 0


def _overlap(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Returns Σ_t x_{t+k} y_t for all lags k ≥ 0."""
    size = 1 << (2 * len(x) - 1).bit_length()
    product = np.fft.rfft(x, size) * np.conj(np.fft.rfft(y, size))
    return np.fft.irfft(product, size)[: len(x)]


def folds_of(
    data: JointTrack, logs: Sequence[MeasuredLog], repeat: int
) -> Int[np.ndarray, "m p"]:
    """Divides the samples into folds g: by setting or load, by record, or by time.

    By time, block b = ⌊t / `BLOCK_S`⌋ belongs to fold g = b mod `FOLDS`.

    Args:
        data: the joint's track.
        logs: the records.
        repeat: samples after which the target repeats; those of a block stay together.

    Returns:
        Fold of every sample [1].

    Source:
        Blocks of time keep correlated samples in one fold: P. Burman, E. Chow and D.
        Nolan, A cross-validatory method for dependent data, 1994.
    """
    m = len(data.valid)
    settings = [tuple(sorted(logs[i].header.settings.items())) for i in data.log]
    loads = [
        (logs[i].header.load.mass_kg, s)
        for i, s in zip(data.log, settings, strict=True)
    ]
    kinds = sorted(set(loads))
    if len(kinds) > 1:
        groups = [kinds.index(x) % 2 for x in loads]
        return np.tile(groups, (m, 1))
    records = sorted(set(data.log.tolist()))
    if len(records) > 1:
        return np.tile([records.index(i) % FOLDS for i in data.log], (m, 1))
    seconds = EVERY * data.dt * (np.arange(m) % repeat if repeat else np.arange(m))
    blocks = np.stack([(seconds + s) // BLOCK_S for s in data.start_s], 1)
    return blocks.astype(int) % FOLDS
