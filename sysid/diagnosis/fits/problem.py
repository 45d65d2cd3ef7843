"""One joint's residuals as a least-squares problem: weights, noise, folds.

The noise of both residuals is coloured. Where the record repeats its targets it is
described by autoregressive filters, from the difference of the repeats, which no model
enters; without repeats it is what neighbouring samples do not share (`noise_floor`),
and a candidate's residual that is larger counts with its correlation in time.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from sysid.diagnosis.fits.equations import Evaluated, equation_errors
from sysid.diagnosis.fits.parameters import Space
from sysid.diagnosis.likelihood.folds import BLOCK_S, folds_of, stay_whole
from sysid.diagnosis.likelihood.noise_floor import difference_noise
from sysid.diagnosis.likelihood.repeats import Repeats, repeats_of
from sysid.diagnosis.likelihood.whitening import (
    Noise,
    autoregressive,
    bulk_deviation,
    correlation_time,
    whitened,
    with_past,
)
from sysid.diagnosis.replay.motion import JointTrack
from sysid.diagnosis.replay.noise import band_noise
from sysid.logs.log import MeasuredLog


@dataclass(frozen=True, eq=False)
class Problem:
    """Residuals of one joint and how they count.

    Attributes:
        channels: names of the two residuals.
        amplifies: whether a candidate may amplify the noise of the readings.
        time_step_s: step of differences by a time; 0: as of any other coordinate [s].
        data: the joint's track.
        space: coordinates of the candidates.
        valid: where the two residuals count (2, m, p).
        fold: fold of every sample (m, p).
        noise: of the residuals.
        repeat: where the motion was made before.
        weight: less than one where sampling may hide fast changes.
        known: which part of the joint can be examined; see `JointDrive`.
        block_s: length of stretches that are held out [s].
        whole: whether folds are settings or loads instead, which are not divided.
        inflated: square of the noise over that which was measured, of both residuals:
            more than one where what a model left counts as noise [1].
        evaluated: what has been evaluated of the equations.
    """

    channels: ClassVar[tuple[str, str]] = ("controller", "mechanics")
    amplifies: ClassVar[bool] = True
    time_step_s: ClassVar[float] = 0.0
    data: JointTrack
    space: Space
    valid: Bool[np.ndarray, "2 m p"]
    fold: Int[np.ndarray, "m p"]
    noise: tuple[Noise, ...]
    repeat: Repeats
    weight: Float[np.ndarray, "2 m p"]
    known: str = "both"
    block_s: float = BLOCK_S
    whole: bool = False
    inflated: tuple[float, float] = (1.0, 1.0)
    evaluated: Evaluated = field(default_factory=Evaluated)

    def raw(
        self, thetas: Float[np.ndarray, "c n"], weigh: bool = True
    ) -> Float[np.ndarray, "c 2 m p"]:
        """Residuals r(θ) = w e(θ) of candidates, zero where they do not count.

        Args:
            thetas: coordinates of candidates, in units of their scales [1].
            weigh: whether to apply the weights w ≤ 1 of uncertain samples.

        Returns:
            Controller and mechanics [N·m]; see `replay.residuals`.

        Source:
            Ours.
        """
        found = equation_errors(self.data, self.space, thetas, self.evaluated)
        weight = self.weight if weigh else 1.0
        return np.where(self.valid, found.astype(float) * weight, 0.0)

    def whitened(self, raw: Float[np.ndarray, "c 2 m p"]) -> Float[np.ndarray, "c r"]:
        """Whitens residuals: ε_t = (r_t − Σ_k a_k r_{t−k}) / s.

        Args:
            raw: residuals [N·m].

        Returns:
            Both residuals in units of white noise [1], flat; zero without a past.

        Source:
            Prediction error of an autoregressive model: L. Ljung, System
            Identification: Theory for the User, 1999, chapter 3.
        """
        out = [
            whitened(raw[:, k], self.valid[k], self.noise[k]).reshape(len(raw), -1)
            for k in range(2)
        ]
        return np.concatenate(out, 1)

    def residual(self, thetas: Float[np.ndarray, "c n"]) -> Float[np.ndarray, "c r"]:
        """Whitened residuals ε(θ) = W r(θ) of candidates, whose squares a fit adds up.

        Args:
            thetas: coordinates of candidates, in units of their scales [1].

        Returns:
            Both residuals in units of white noise [1], flat.

        Source:
            Ours: `whitened` of `raw`.
        """
        return self.whitened(self.raw(thetas))

    def folds(self) -> Int[np.ndarray, " r"]:
        """Fold g(i) ∈ {0, 1, …} of every whitened residual i [1].

        Source:
            Ours; see `folds.folds_of`.
        """
        return np.concatenate([self.fold.ravel()] * 2)

    def counts(self) -> Bool[np.ndarray, " r"]:
        """Mask of the whitened residuals that count: c_t = ∧_{k ≤ K} valid_{t−k}.

        Returns:
            Whether a sample and the K before it, which whiten it, are valid [1].

        Source:
            Ours.
        """
        kept = [
            with_past(self.valid[k], len(self.noise[k].a)).ravel() for k in range(2)
        ]
        return np.concatenate(kept)

    def channel_counts(self) -> Int[np.ndarray, "2"]:
        """Number of residuals that count in each channel, n = Σ_t c_t [1].

        Source:
            Ours.
        """
        return self.counts().reshape(2, -1).sum(1)

    @property
    def samples(self) -> int:
        """Number of residuals that count."""
        return int(self.counts().sum())

    def with_noise(self, raw: Float[np.ndarray, "2 m p"]) -> "Problem":
        """Takes the noise from the repeats of a residual, else from its neighbours.

        Samples of uncertainty u weigh w = 1 / √(1 + (u / s)²) where s is the noise.

        Args:
            raw: both residuals of one candidate, without weights [N·m].

        Returns:
            The problem with noise and weights [1], and the noise of the readings behind
            its whitening filters.

        Source:
            Ours; differences of periods as a noise estimate without a model: R.
            Pintelon and J. Schoukens, System Identification: A Frequency Domain
            Approach, 2001.
        """
        noise, weights = [], []
        for k in range(2):
            size = self._noise(k, raw[k]).deviation
            if self.repeat:
                series, valid = self.differences(raw[k], self.valid[k])
                size = bulk_deviation(series[valid]) if valid.any() else 1.0
            weights.append(1.0 / np.hypot(1.0, self.data.uncertainty[k] / size))
            noise.append(self._noise(k, weights[k] * raw[k]))
        data = self.data
        in_band = [band_noise(data.noise, data.dt, n.a) for n in noise]
        behind_filters = jnp.asarray(np.stack(in_band), jnp.float32)
        track = replace(data.track, noise=behind_filters)
        return replace(
            self,
            data=replace(data, track=track),
            noise=tuple(noise),
            weight=np.stack(weights),
        )

    def with_remaining(self, raw: Float[np.ndarray, "2 m p"]) -> "Problem":
        """Takes what a model leaves as noise: s'² = max(s², τ mean r²).

        Args:
            raw: its residuals [N·m].

        Returns:
            The problem with white noise of that size.

        Source:
            Ours: without repeats errors that no effect removes pass for noise.
        """
        noise, more = [], []
        for r, valid, known in zip(raw, self.valid, self.noise, strict=True):
            left = np.mean(r[valid] ** 2) if valid.any() else 0.0
            size = float(np.sqrt(correlation_time(r, valid) * left))
            noise.append(Noise(np.zeros(0), max(size, known.deviation)))
            more.append((noise[-1].deviation / known.deviation) ** 2)
        return replace(self, noise=tuple(noise), inflated=(more[0], more[1]))

    def _noise(self, k: int, series: Float[np.ndarray, "m p"]) -> Noise:
        """Noise of one residual."""
        valid = self.valid[k]
        if self.repeat:
            return autoregressive(*self.repeat.differences(series, valid))
        track = self.data.track
        angle, speed, acc, effort = np.asarray(track.noise[k], float) ** 2
        kp, kd, inertia, measured = (
            float(np.mean(np.asarray(x)))
            for x in (track.kp, track.kd, track.inertia, track.measured)
        )
        # Of the mechanics the servo's share enters where the effort is not logged.
        servo = 1.0 if k == 0 else 1.0 - measured
        logged = 1.0 if k == 0 else measured
        variances = (
            servo * kp**2 * angle + logged * effort,
            servo * kd**2 * speed,
            k * inertia**2 * acc,
        )
        deviation = difference_noise(series, valid, np.array(variances))
        return Noise(np.zeros(0), deviation)

    def differences(
        self, series: Float[np.ndarray, "m p"], valid: Bool[np.ndarray, "m p"]
    ) -> tuple[Float[np.ndarray, "m p"], Bool[np.ndarray, "m p"]]:
        """Difference of repeats d = (r − r') / √2, or else the whole series.

        Args:
            series: a residual r [N·m].
            valid: where it counts.

        Returns:
            d [N·m], which has the variance of the noise, and where it counts.

        Source:
            Ours.
        """
        return (
            self.repeat.differences(series, valid) if self.repeat else (series, valid)
        )


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
    headers = [logs[i].header for i in data.log]
    kinds = [(h.settings, h.load, h.palm_quat_w) for h in headers]
    repeat = repeats_of(data, kinds)
    white = Noise(np.zeros(0), 1.0)
    return Problem(
        data=data,
        space=space,
        valid=np.stack([controller, mechanics]),
        fold=folds_of(data, logs, repeat),
        noise=(white,) * 2,
        repeat=repeat,
        weight=np.ones((2, *data.valid.shape)),
        known=known,
        whole=stay_whole(data, logs),
    )
