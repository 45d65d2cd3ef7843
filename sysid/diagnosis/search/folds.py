"""Folds of the cross-validation."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Int

from sysid.diagnosis.replay.band import EVERY
from sysid.diagnosis.replay.motion import JointTrack
from sysid.diagnosis.search.repeats import Repeats
from sysid.logs.log import MeasuredLog

FOLDS = 3
"""Number of folds of one record, and of several."""

BLOCK_S = 1.0
"""Length of the blocks that are dealt out to folds [s]."""


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
    seconds = EVERY * data.dt * repeats.root + data.start_s[repeats.root_piece]
    return (seconds // BLOCK_S).astype(int) % FOLDS
