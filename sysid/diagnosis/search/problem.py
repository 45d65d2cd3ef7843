"""One joint's residuals as a least-squares problem: weights, noise floor, folds.

The noise of both residuals is coloured. It is described by autoregressive filters
where the record repeats its targets from the difference of the repeats, which no
model enters. Without repeats noise and missing effects cannot be told apart
beforehand: what a candidate leaves counts as noise, with its correlation in time.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from sysid.diagnosis.replay.residuals import EVERY, forced_residuals, sample_rows
from sysid.diagnosis.replay.track import JointTrack, band_noise
from sysid.diagnosis.search.parameters import Space
from sysid.logs.log import MeasuredLog

ORDER = 4
LANES = 64
FOLDS = 3
BLOCK_S = 1.0
ALIKE = 0.995
"""Correlation above which two stretches of the target are repeats."""

CHANNELS = ("controller", "mechanics")
LONGEST = 20.0
"""Largest number of samples that may tell the same."""


@dataclass(frozen=True, eq=False)
class Noise:
    """Autoregressive noise of one residual: r_t = Σ a_k r_{t−k} + e_t, e ~ (0, s²).

    Attributes:
        a: a_k.
        deviation: s.
    """

    a: Float[np.ndarray, " k"]
    deviation: float


@dataclass(frozen=True, eq=False)
class Problem:
    """Residuals of one joint and how they count.

    Attributes:
        data: the joint's track.
        space: coordinates of the candidates.
        valid: where the two residuals count (2, m, p).
        fold: fold of every sample (m, p).
        noise: of the residuals.
        repeat: samples after which the target repeats; 0 if it does not.
        weight: less than one where sampling may hide fast changes.
    """

    data: JointTrack
    space: Space
    valid: Bool[np.ndarray, "2 m p"]
    fold: Int[np.ndarray, "m p"]
    noise: tuple[Noise, ...]
    repeat: int
    weight: Float[np.ndarray, "2 m p"]

    def raw(
        self, thetas: Float[np.ndarray, "c n"], weigh: bool = True
    ) -> Float[np.ndarray, "c 2 m p"]:
        """Returns the residuals of candidates [N·m], zero where they do not count."""
        parts = []
        for first in range(0, len(thetas), LANES):
            some = thetas[first : first + LANES]
            lanes = np.concatenate([some, np.repeat(some[:1], LANES - len(some), 0)])
            params, nuisance = self.space.values(lanes)
            out = forced_residuals(
                self.data.track,
                params,
                nuisance,
                np.float32(self.data.friction_speed),
                self.data.dt,
                self.space.effects,
            )
            parts.append(np.moveaxis(np.asarray(out, float), -1, 0)[: len(some)])
        weight = self.weight if weigh else 1.0
        return np.where(self.valid, np.concatenate(parts) * weight, 0.0)

    def whitened(self, raw: Float[np.ndarray, "c 2 m p"]) -> Float[np.ndarray, "c r"]:
        """Returns residuals in units of white noise, flat."""
        out = [
            _white(raw[:, k], self.valid[k], self.noise[k]).reshape(len(raw), -1)
            for k in range(2)
        ]
        return np.concatenate(out, 1)

    def residual(self, thetas: Float[np.ndarray, "c n"]) -> Float[np.ndarray, "c r"]:
        """Returns the weighted residuals of candidates."""
        return self.whitened(self.raw(thetas))

    def folds(self) -> Int[np.ndarray, " r"]:
        """Returns the fold of every weighted residual."""
        return np.concatenate([self.fold.ravel()] * 2)

    def counts(self) -> Bool[np.ndarray, " r"]:
        """Tells which weighted residuals count."""
        kept = [_whole(self.valid[k], len(self.noise[k].a)).ravel() for k in range(2)]
        return np.concatenate(kept)

    def with_noise(self, raw: Float[np.ndarray, "2 m p"]) -> "Problem":
        """Takes the noise from the repeats of a residual, else from the residual."""
        noise, weights = [], []
        made = _autoregression if self.repeat else _correlated
        for k in range(2):
            series, valid = self.differences(raw[k], self.valid[k])
            size = _bulk(series[valid]) if valid.any() else 1.0
            weights.append(1.0 / np.hypot(1.0, self.data.doubt[k] / size))
            noise.append(made(*self.differences(weights[k] * raw[k], self.valid[k])))
        data = self.data
        loud = [band_noise(data.noise, data.dt, n.a) for n in noise]
        told = jnp.asarray(np.stack(loud), jnp.float32)
        track = replace(data.track, noise=told)
        return replace(
            self,
            data=replace(data, track=track),
            noise=tuple(noise),
            weight=np.stack(weights),
        )

    def differences(self, series: np.ndarray, valid: np.ndarray):
        """Returns the difference of repeats, or else the whole."""
        n = self.repeat
        if not n:
            return series, valid
        return (series[n:] - series[:-n]) / np.sqrt(2.0), valid[n:] & valid[:-n]


def make_problem(
    data: JointTrack, space: Space, logs: Sequence[MeasuredLog], known: str
) -> Problem:
    """Makes the problem of a joint; its noise is still white of size one.

    Args:
        data: the joint's track.
        space: coordinates.
        logs: the records.
        known: which part of the joint can be examined; see `JointDrive`.
    """
    nowhere = np.zeros_like(data.valid)
    controller = nowhere if known == "mechanics" else data.valid & data.effort
    mechanics = nowhere if known == "controller" else data.valid
    if known == "mechanics":
        mechanics = data.valid & data.effort
    # A joint at rest is balanced by whatever friction it has.
    mechanics = mechanics & data.moving
    repeat = _repeat(data)
    white = Noise(np.zeros(0), 1.0)
    return Problem(
        data=data,
        space=space,
        valid=np.stack([controller, mechanics]),
        fold=_folds(data, logs, repeat),
        noise=(white,) * 2,
        repeat=repeat,
        weight=np.ones((2, *data.valid.shape)),
    )


def _white(r: np.ndarray, valid: np.ndarray, noise: Noise) -> np.ndarray:
    """Applies the whitening filter along time; zero where it lacks its past."""
    order = len(noise.a)
    out = r.copy()
    for k, a in enumerate(noise.a, 1):
        out[:, k:] -= a * r[:, :-k]
    return np.where(_whole(valid, order), out / noise.deviation, 0.0)


def _whole(valid: np.ndarray, order: int) -> np.ndarray:
    """Tells where a sample and its `order` predecessors are valid."""
    whole = valid.copy()
    for k in range(1, order + 1):
        whole[k:] &= valid[:-k]
        whole[:k] = False
    return whole


def _bulk(x: np.ndarray) -> float:
    """Returns the deviation of most of some values; a few may lie far out."""
    return max(float(np.median(np.abs(x))) / 0.6745, 1e-12)


def _autoregression(series: np.ndarray, valid: np.ndarray) -> Noise:
    """Fits the noise of a residual by least squares."""
    whole = _whole(valid, ORDER)
    if whole.sum() < 10 * ORDER:
        return Noise(
            np.zeros(0),
            max(float(np.std(series[valid])), 1e-12) if valid.any() else 1.0,
        )
    rows = np.stack([np.roll(series, k, 0)[whole] for k in range(1, ORDER + 1)], 1)
    y = series[whole]
    gram = rows.T @ rows
    a = np.linalg.solve(gram + 1e-6 * np.trace(gram) * np.eye(ORDER), rows.T @ y)
    rest = y - rows @ a
    return Noise(a, max(float(np.sqrt(np.mean(rest**2))), 1e-12))


def _correlated(series: np.ndarray, valid: np.ndarray) -> Noise:
    """Takes a residual that may hold the effect itself as noise.

    A filter would remove the effect with it. Instead the deviation is raised by the
    time τ = 1 + 2 Σ ρ_k over which samples tell the same.
    """
    if not valid.any():
        return Noise(np.zeros(0), 1.0)
    x = np.where(valid, series, 0.0)
    power = float(np.mean(x[valid] ** 2))
    total = 1.0
    for k in range(1, min(200, len(x) // 4)):
        both = valid[k:] & valid[:-k]
        if both.sum() < 20:
            break
        rho = float(np.mean((x[k:] * x[:-k])[both])) / max(power, 1e-30)
        if rho < 0.1:
            break
        total += 2.0 * rho
    return Noise(np.zeros(0), max(np.sqrt(power * min(total, LONGEST)), 1e-12))


def _repeat(data: JointTrack) -> int:
    """Returns after how many samples the target repeats itself, 0 if it does not."""
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


def _folds(data: JointTrack, logs: Sequence[MeasuredLog], repeat: int) -> np.ndarray:
    """Divides the samples: by setting of the controller, by record, or by time."""
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
    length = max(BLOCK_S, 1.0)
    blocks = np.stack([(seconds + s) // length for s in data.start_s], 1)
    return blocks.astype(int) % FOLDS
