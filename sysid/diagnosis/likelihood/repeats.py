"""Where a motion was made before: in the same piece, in another one, in another record.

The residuals of two runs of the same motion differ by noise alone, whatever the model.
A block of a second repeats an earlier stretch if the targets of that second, and of the
one before it, are the same; the lag need not be a whole number of samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from sysid.diagnosis.replay.band import EVERY, sample_rows
from sysid.diagnosis.replay.motion import JointTrack

ALIKE = 0.999
"""Likeness above which two stretches of the targets are repeats."""

BLOCK_S = 1.0
"""Length of the blocks that are looked for, and of what must lie before them [s]."""

LEAST_SHARE = 0.4
"""Share of the samples that must be repeats for a noise floor to be known."""

_TAPS = 4
_WHOLE = 0.02


@dataclass(frozen=True, eq=False)
class Repeats:
    """The earlier twin of every sample (m) of every piece (p).

    Attributes:
        piece: piece of the twin; -1 without one.
        lag: samples from the start of that piece to the twin, less those of the sample.
        root: number of the first sample of a chain of twins, in its piece.
        root_piece: its piece.
    """

    piece: Int[np.ndarray, "m p"]
    lag: Float[np.ndarray, "m p"]
    root: Int[np.ndarray, "m p"]
    root_piece: Int[np.ndarray, "m p"]

    def __bool__(self) -> bool:
        """Whether enough of the motion repeats."""
        return bool(np.mean(self.piece >= 0) > LEAST_SHARE)

    def differences(
        self, series: Float[np.ndarray, "m p"], valid: Bool[np.ndarray, "m p"]
    ) -> tuple[Float[np.ndarray, "m p"], Bool[np.ndarray, "m p"]]:
        """D = (r − r') / √2 with the twin's value r' of every sample.

        Args:
            series: r, a residual [N·m].
            valid: where it counts.

        Returns:
            d [N·m], which has the variance of the noise, and where it counts.

        Source:
            Ours; between samples by a windowed sinc.
        """
        d, counts = np.zeros_like(series), np.zeros_like(valid)
        rows = np.arange(len(series))
        for p in range(series.shape[1]):
            mine = self.piece[:, p]
            keys = np.stack([mine, np.round(self.lag[:, p] * 50)], 1)[mine >= 0]
            for other, lag in np.unique(keys, axis=0):
                here = (mine == other) & (np.round(self.lag[:, p] * 50) == lag)
                at = rows[here] + lag / 50.0
                twin, ok = _read(series[:, int(other)], valid[:, int(other)], at)
                d[here, p] = (series[here, p] - twin) / np.sqrt(2.0)
                counts[here, p] = valid[here, p] & ok
        return d, counts


def _read(x: np.ndarray, valid: np.ndarray, at: np.ndarray):
    """Reads a series between its samples."""
    low = np.round(at).astype(int)
    part = at - low
    reach = 0 if np.abs(part).max(initial=0.0) < _WHOLE else _TAPS
    total, ok, weight = np.zeros(len(at)), np.ones(len(at), bool), np.zeros(len(at))
    for k in range(-reach, reach + 1):
        place = np.clip(low + k, 0, len(x) - 1)
        ok &= valid[place] & (low + k >= 0) & (low + k < len(x))
        w = np.sinc(part - k) * np.cos(0.5 * np.pi * (part - k) / (_TAPS + 1.0)) ** 2
        total, weight = total + w * x[place], weight + w
    return total / weight, ok


def repeats_of(data: JointTrack, kinds: Sequence[object] = ()) -> Repeats:
    """Finds the repeats of the targets of one joint.

    For every block the earlier stretch of the largest likeness
    1 − Σ (x − x')² / (Σ (x − x̄)² + Σ (x' − x̄)²), if above `ALIKE`. Under a push from
    outside nothing is a repeat.

    Args:
        data: the joint's track.
        kinds: settings and loads of the pieces; those of another kind do not repeat.
    """
    steps = len(data.track.cmd)
    rows = sample_rows(steps)
    count, pieces = len(rows), data.valid.shape[1]
    cmd = np.asarray(data.track.cmd, float)
    free = ~np.any(np.asarray(data.track.ext) != 0.0, axis=0)
    kinds = kinds or [0] * pieces
    length = [int(np.flatnonzero(v).max(initial=0)) + 1 for v in data.valid.T]
    piece = np.full((count, pieces), -1)
    lag = np.zeros((count, pieces))
    root = np.tile(np.arange(count)[:, None], (1, pieces))
    root_piece = np.tile(np.arange(pieces), (count, 1))
    block = max(round(BLOCK_S / (EVERY * data.dt)), 2)
    for p in range(pieces):
        for first in range(0, length[p], block):
            here = slice(first, min(first + block, length[p]))
            alike = [o for o in range(p + 1) if free[o] and kinds[o] == kinds[p]]
            alike = alike if free[p] else []
            found = _earlier(cmd, data.valid, rows, (p, here), alike)
            if found is None:
                continue
            other, apart = found
            piece[here, p], lag[here, p] = other, apart
            twin = np.clip(
                np.arange(here.start, here.stop) + round(apart), 0, count - 1
            )
            root[here, p] = root[twin, other]
            root_piece[here, p] = root_piece[twin, other]
    return Repeats(piece, lag, root, root_piece)


def _earlier(cmd, valid, rows, place, alike) -> tuple[int, float] | None:
    """Returns the earlier piece and the lag [samples] at which a block was before."""
    p, here = place
    long = EVERY * (here.stop - here.start)
    start, stop = rows[here.start] - long, rows[here.stop - 1] + 1
    if start < 0 or not valid[here, p].mean() > 0.5:
        return None
    x = cmd[start:stop, p] - cmd[start:stop, p].mean()
    power = float(x @ x)
    best = (ALIKE, None)
    for other in alike:
        # In its own piece a twin ends before the block begins.
        y = cmd[: start + long if other == p else len(cmd), other]
        if len(y) < len(x) or power < 1e-18 * max(float(np.ptp(cmd)) ** 2, 1e-300):
            continue
        likeness = _likeness(x, power, y - cmd[start:stop, p].mean())
        at = int(np.argmax(likeness))
        if likeness[at] > best[0]:
            best = (likeness[at], (other, (_peak(likeness, at) - start) / EVERY))
    return best[1]


def _likeness(x: np.ndarray, power: float, y: np.ndarray) -> np.ndarray:
    """Likeness of a stretch with every stretch of a signal that is as long."""
    size = 1 << (len(x) + len(y) - 1).bit_length()
    product = np.fft.rfft(y, size) * np.conj(np.fft.rfft(x, size))
    both = np.fft.irfft(product, size)[: len(y) - len(x) + 1]
    squares = np.concatenate([[0.0], np.cumsum(y**2)])
    other = squares[len(x) :] - squares[: -len(x)]
    return 2.0 * both / np.maximum(power + other, 1e-300)


def _peak(likeness: np.ndarray, at: int) -> float:
    """Place of a maximum between samples: the vertex of a parabola."""
    if not 0 < at < len(likeness) - 1:
        return float(at)
    left, top, right = likeness[at - 1 : at + 2]
    bend = left - 2.0 * top + right
    return at + 0.5 * (left - right) / bend if bend < 0.0 else float(at)
