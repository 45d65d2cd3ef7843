"""Kinetic friction of a fingertip from loaded pulls.

A tip that carries a known normal force is drawn along the floor at constant speed while
a load cell measures the pull. While it slides, μ_k = F_pull / F_normal.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import uniform_filter1d

from envs.errors import InputError
from sysid.logs.columns import FINGERS
from sysid.logs.log import MeasuredLog

SETTING = "normal_n"
"""Setting of a log's header that marks a pull and states the normal force [N]."""

_SLIDING_SHARE = 0.5
_START, _END = 0.2, 0.05
_CHATTER_S = 0.2
_LEAST_ROWS = 20
_BLOCKS = 10


@dataclass(frozen=True, eq=False)
class Pull:
    """One pull.

    Attributes:
        finger: whose tip was pulled.
        normal_n: normal force [N].
        friction: mean of pull / normal force while sliding.
        deviation: of that mean, from blocks of consecutive rows.
        start_s, stop_s: when it slid [s].
        source: the log.
        t_s, ratio: all readings, pull / normal force.
    """

    finger: str
    normal_n: float
    friction: float
    deviation: float
    start_s: float
    stop_s: float
    source: str
    t_s: Float[np.ndarray, " n"]
    ratio: Float[np.ndarray, " n"]


def is_pull(log: MeasuredLog) -> bool:
    """Whether a log is a loaded pull."""
    return SETTING in log.header.settings


def pull_of(log: MeasuredLog) -> Pull:
    """Reads the friction from a pull.

    The tip slides in the longest time with at least half of the usual pull, averaged
    over a fifth of a second, for a tip that chatters on its spring slides all the same;
    the first fifth of it is left out, for it holds the build-up and the breakaway peak,
    which belong to static friction, and the last twentieth for the release.

    Raises:
        InputError: no load cell, no normal force, or a tip that never slides.
    """
    normal = log.header.settings[SETTING]
    if not normal > 0.0:
        valid = "a normal force above 0 N"
        raise InputError(log.source, f"settings.{SETTING}", normal, valid)
    cells = [f for f in FINGERS if f"force.{f}" in log.columns]
    if len(cells) != 1:
        valid = "one column force.<finger> with the pull"
        raise InputError(log.source, "columns", ", ".join(cells) or "none", valid)
    t_s, force = log.samples(f"force.{cells[0]}")
    width = max(1, round(_CHATTER_S / np.median(np.diff(t_s)))) if len(t_s) > 1 else 1
    rows = _sliding(log.source, cells[0], uniform_filter1d(np.abs(force), width))
    ratio = np.abs(force[rows]) / normal
    blocks = [np.mean(part) for part in np.array_split(ratio, _BLOCKS)]
    deviation = float(np.std(blocks, ddof=1) / np.sqrt(_BLOCKS))
    return Pull(
        finger=cells[0],
        normal_n=float(normal),
        friction=float(np.mean(ratio)),
        deviation=max(deviation, 1e-4),
        start_s=float(t_s[rows][0]),
        stop_s=float(t_s[rows][-1]),
        source=log.source,
        t_s=t_s,
        ratio=np.abs(force) / normal,
    )


def _sliding(source: str, finger: str, force: np.ndarray) -> slice:
    """Returns the rows in which the tip slides."""
    strong = force > _SLIDING_SHARE * np.quantile(force, 0.9)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], strong, [0]])))
    runs = edges.reshape(-1, 2)
    first, last = (int(x) for x in runs[np.argmax(runs[:, 1] - runs[:, 0])])
    rows = last - first
    first, last = first + round(_START * rows), last - round(_END * rows)
    if last - first < _LEAST_ROWS:
        valid = f"a pull that slides for at least {_LEAST_ROWS} readings"
        found = f"{max(last - first, 0)} readings"
        raise InputError(source, f"force.{finger}", found, valid)
    return slice(first, last)
