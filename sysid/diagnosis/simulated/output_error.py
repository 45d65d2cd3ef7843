"""The output error of one joint as a least-squares problem, where no effort was logged.

Without an effort the equations lack a side: the servo's torque is what its law makes of
angles that were read at moments, and their derivatives. The simulated angle needs
neither. So candidates come from the equations, whose residual is quick and smooth, and
are then fitted to the angle, and compared by it.
"""

from dataclasses import dataclass, field, fields, replace
from typing import ClassVar

import numpy as np
from jaxtyping import Float
from scipy.ndimage import maximum_filter1d

from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.likelihood.noise_floor import difference_noise
from sysid.diagnosis.likelihood.whitening import (
    Noise,
    autoregressive,
    bulk_deviation,
    correlation_time,
)
from sysid.diagnosis.replay.band import FINE_TAPS, sample_rows
from sysid.diagnosis.replay.timing_uncertainty import CYCLE_S, sampling_uncertainty
from sysid.diagnosis.simulated.closed_loop import SUBSTEP_S, simulated
from sysid.diagnosis.simulated.known import Known

FAR = 1e3
"""Largest error that counts, in units of the angle's size: of unstable candidates."""


@dataclass(frozen=True, eq=False)
class OutputProblem(Problem):
    """The error of the simulated angle in the place of the equations' residuals.

    Attributes:
        equations: the residuals from which its candidates come.
        stages: candidates that came from them, by the effects of the smaller model.
        seen: what was simulated.
        push_shares: how much is lost of what may be of pushes as they are sampled, and
            as they are read [1].
    """

    channels: ClassVar[tuple[str, str]] = ("", "position")
    amplifies: ClassVar[bool] = False
    # At its limit a servo does not see when within a substep a target came: the error
    # is a staircase over delays, whose slope shows over a whole step of it.
    time_step_s: ClassVar[float] = SUBSTEP_S
    equations: Problem | None = None
    stages: dict[tuple[str, ...], list] = field(default_factory=dict)
    seen: Known = field(default_factory=Known)
    push_shares: tuple[float, float] = (1.0, 1.0)

    @property
    def reading_noise(self) -> float:
        """Noise of the readings in an angle that is smoothed, s √(Σ_k w_k²) [rad]."""
        return self.data.noise[0] * float(np.sqrt(np.sum(FINE_TAPS**2)))

    def raw(
        self, thetas: Float[np.ndarray, "c n"], weigh: bool = True
    ) -> Float[np.ndarray, "c 2 m p"]:
        """Output errors r(θ) = y − ŷ(θ) of candidates, in the second channel.

        Args:
            thetas: coordinates of candidates, in units of their scales [1].
            weigh: whether to apply the weights of uncertain samples.

        Returns:
            Nothing and the error of the angle [rad].

        Source:
            Output-error method: L. Ljung, System Identification: Theory for the User,
            1999, section 4.2.
        """
        track = self.data.track
        rows = sample_rows(len(track.cmd))
        measured, most = np.asarray(track.pos, float), FAR * self.data.angle_scale
        error = measured[rows] - simulated(self, thetas, rows, self.seen)
        error = np.clip(np.nan_to_num(error, nan=most), -most, most)
        error = np.where(self.valid[1], error, 0.0)
        weight = self.weight if weigh else 1.0
        return np.stack([np.zeros_like(error), error], 1) * weight

    def with_noise(self, raw: Float[np.ndarray, "2 m p"]) -> "OutputProblem":
        """Takes the noise from the repeats of the error, else from its neighbours.

        When a servo takes a target is known to its cycle, so an angle that moves at
        speed v is uncertain by u = `CYCLE_S` |v| and weighs w = 1 / √(1 + (u / s)²),
        with the largest |v| of three samples about it: a fast servo starts between two.
        What others push is known as well as rows sample their motion and as none of
        them is missing: `JointTrack.pushed`, u, may move this joint by u / kp more. And
        between its rows the angle itself is known as well as they show its motion.

        Args:
            raw: errors of one candidate, without weights [rad].

        Returns:
            The problem with noise [rad] and weights [1].

        Source:
            Ours; as `Problem.with_noise`.
        """
        valid, size = self.valid[1], self.noise_of(raw)
        late, between, *pushed = self.unsure()
        timed = np.hypot(late, np.hypot(*pushed))
        unsure = np.hypot(timed, between)
        if self.repeat:
            alike = 1.0 / np.hypot(1.0, timed / size)
            weight = 1.0 / np.hypot(1.0, unsure / size)
            # Repeats jitter each in its own way: a weight of both for their difference.
            apart = self.repeat.differences(between**2, valid)[0] / np.sqrt(2.0)
            both = np.sqrt(np.maximum(between**2 - apart, 0.0))
            shared = 1.0 / np.hypot(1.0, np.hypot(timed, both) / size) / alike
            series, counts = self.repeat.differences(alike * raw[1], valid)
            noise = autoregressive(shared * series, counts)
        else:
            weight = 1.0 / np.hypot(1.0, unsure / size)
            noise = Noise(np.zeros(0), size)
        weights = np.stack([np.ones_like(weight), weight])
        return replace(self, noise=(self.noise[0], noise), weight=weights)

    def noise_of(self, raw: Float[np.ndarray, "2 m p"]) -> float:
        """Noise of the angle's error where its times are known [rad].

        Args:
            raw: errors of one candidate, without weights [rad].
        """
        valid = self.valid[1]
        if not self.repeat:
            readings = np.array([self.reading_noise**2, 0.0, 0.0])
            return difference_noise(raw[1], valid, readings, band_steps=0.0)
        series, counts = self.repeat.differences(raw[1], valid)
        return bulk_deviation(series[counts]) if counts.any() else 1.0

    def unsure(self) -> Float[np.ndarray, "4 m p"]:
        """How far the angle is uncertain, each for itself [rad].

        By a servo's cycle, between its rows, and by pushes of others as they are
        sampled and as they are read.
        """
        rows = sample_rows(len(self.data.track.cmd))
        speed = np.abs(np.asarray(self.data.track.vel, float)[rows])
        late = CYCLE_S * maximum_filter1d(speed, 3, axis=0)
        return np.stack([late, self._unread()[rows], *self._pushed()[:, rows]])

    def _pushed(self) -> Float[np.ndarray, "2 t p"]:
        """Returns how far pushes, as sampled and as read, may lead the angle astray."""
        kp = np.maximum(np.asarray(self.data.track.kp, float), 1e-12)
        whole = self.data.pushed
        sampled = sampling_uncertainty(np.asarray(self.data.track.push, float))
        sampled = np.minimum(sampled, whole)
        parts = np.stack([sampled, np.sqrt(whole**2 - sampled**2)]) / kp
        return np.array(self.push_shares)[:, None, None] * parts

    def _unread(self) -> Float[np.ndarray, "t p"]:
        """Returns what smoothing leaves of the error between rows, √(Σ_k w_k² u_k²)."""
        squares = self.data.unread**2
        parts = [np.convolve(u, FINE_TAPS**2, "same") for u in squares.T]
        return np.sqrt(np.stack(parts, 1))

    def with_remaining(self, raw: Float[np.ndarray, "2 m p"]) -> "OutputProblem":
        """Takes what a model leaves as noise: s'² = max(s_y², τ mean r²).

        Args:
            raw: its errors [rad].

        Returns:
            The problem with white noise of that size, at least that of the readings.

        Source:
            Ours; as `Problem.with_remaining`, but what neighbours of a large smooth
            error do not share is not noise.
        """
        r, valid = raw[1], self.valid[1]
        size = np.sqrt(correlation_time(r, valid) * np.mean(r[valid] ** 2))
        known = Noise(np.zeros(0), max(float(size), self.reading_noise, 1e-12))
        return replace(self, noise=(self.noise[0], known))


def output_problem(problem: Problem) -> OutputProblem | None:
    """Makes the output error that decides for a joint; None where the equations do.

    They do where efforts were logged, and where a law or a force is not known.

    Args:
        problem: the equations' residuals.
    """
    return None if problem.data.effort.any() else output_error(problem)


def output_error(problem: Problem) -> OutputProblem | None:
    """Makes the output error of a joint; None where it cannot be simulated.

    Args:
        problem: the equations' residuals.
    """
    data = problem.data
    if problem.known != "both" or not data.valid.any():
        return None
    same = {f.name: getattr(problem, f.name) for f in fields(Problem)}
    seen = np.stack([np.zeros_like(data.valid), data.valid])
    white = (Noise(np.zeros(0), 1.0),) * 2
    changed = {"valid": seen, "noise": white, "weight": np.ones(seen.shape)}
    return OutputProblem(**same | changed, equations=problem)
