"""Shapes of excitation between -1 and 1, each from rest to rest.

A shape is a function of (seconds, rate [Hz], generator, `WaveLimits`) that returns one
value per row; it begins and ends at 0, so shapes can follow each other in any order.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

PERIODS, DROPPED_PERIODS = 8, 2
"""Periods of a multisine, and how many of them belong to the transient."""

LOWEST_HZ, HIGHEST_HZ = 0.1, 8.0


@dataclass(frozen=True)
class Wave:
    """One kind of excitation.

    Attributes:
        shape: the function.
        share: amplitude as share of the reach of a joint.
        seconds: usual length [s].
        jumps: whether targets jump, which no speed limit of the targets can bound.
        shows: what it is good for, in words.
    """

    shape: Callable[..., Float[np.ndarray, " n"]]
    share: float
    seconds: float
    jumps: bool
    shows: str


def _time(seconds: float, rate_hz: float) -> Float[np.ndarray, " n"]:
    return np.arange(round(seconds * rate_hz)) / rate_hz


def triangle(phase: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """2/π asin(sin 2πφ): 0 → 1 → -1 → 0 over every unit of phase, straight in between.

    Args:
        phase: φ, in periods [1].

    Source:
        Textbook triangle wave.
    """
    return 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * phase))


def _triangles(count: int):
    def shape(seconds, rate_hz, rng):
        return triangle(_time(seconds, rate_hz) * count / seconds)

    return shape


def _ramps(seconds, rate_hz, rng):
    """Up and down at four speeds, each twice as slow as the one before."""
    parts = seconds * np.array([1.0, 2.0, 4.0, 8.0]) / 15.0
    made = [triangle(_time(part, rate_hz) / part) for part in parts]
    return _fitted(np.concatenate(made), seconds, rate_hz)


def _steps(seconds, rate_hz, rng):
    """Jumps of different size to both sides; the last one returns."""
    levels = np.array([1.0, -1.0, 0.5, -0.5, 0.25, -0.25, 0.75])
    return _levels(np.append(rng.permutation(levels), 0.0), seconds, rate_hz)


def _holds(seconds, rate_hz, rng):
    """Five postures, entered by a smooth ramp: for static loads."""
    levels = np.array([1.0, 0.5, -0.5, -1.0, 0.0])
    return _smooth(_levels(levels, seconds, rate_hz), 0.3 * seconds / 5, rate_hz)


def _pulses(seconds, rate_hz, rng):
    """Short kicks to alternating sides with rest after each."""
    t = _time(seconds, rate_hz)
    phase = t / seconds * 6.0
    side = np.where(np.floor(phase) % 2 == 0, 1.0, -1.0)
    return side * ((phase % 1.0 > 0.3) & (phase % 1.0 < 0.45))


def _chirp(seconds, rate_hz, rng):
    """Sine from 0.1 to 8 Hz (or a quarter of the rate), logarithmic; then smaller."""
    half = seconds / 2.0
    once = _sweep(half, rate_hz)
    return _fitted(np.concatenate([once, 0.3 * once]), seconds, rate_hz)


def _sweep(seconds: float, rate_hz: float) -> Float[np.ndarray, " n"]:
    """Sin 2π f₁ T / ln(f₂/f₁) ((f₂/f₁)^{t/T} - 1), faded at both ends."""
    t = _time(seconds, rate_hz)
    low, high = max(LOWEST_HZ, 1.0 / seconds), min(HIGHEST_HZ, rate_hz / 4.0)
    ratio = np.log(high / low)
    phase = 2.0 * np.pi * low * seconds / ratio * np.expm1(ratio * t / seconds)
    fade = np.minimum(1.0, np.minimum(t, seconds - t) / (0.03 * seconds))
    return np.sin(phase) * fade


def _multisine(seconds, rate_hz, rng):
    """Odd random-phase multisine: `PERIODS` periods of odd lines up to 8 Hz.

    Of every four odd lines a random one is left out: what appears there, and on even
    lines, is nonlinear (Schoukens, Vaes and Pintelon 2016). It begins anywhere in its
    period and is brought in from 0 during the first period, which is dropped anyway.
    """
    t, period = _time(seconds, rate_hz), seconds / PERIODS
    lines = multisine_lines(period, rate_hz, rng)
    phases = rng.uniform(0.0, 2.0 * np.pi, lines.size)
    wave = np.cos(2.0 * np.pi * np.outer(t / period, lines) + phases).sum(1)
    ends = np.minimum(t / period, (seconds - t) / (0.25 * period))
    return wave / np.max(np.abs(wave)) * np.clip(ends, 0.0, 1.0)


def multisine_lines(
    period_s: float, rate_hz: float, rng: np.random.Generator
) -> Float[np.ndarray, " n"]:
    """K ∈ {1, 3, 5, …, f_max T} less a random one of every four: the excited lines.

    Args:
        period_s: T [s].
        rate_hz: of the targets; f_max is 8 Hz or a quarter of it [Hz].
        rng: draws the lines that are left silent.

    Returns:
        k, in units of 1 / T [1].

    Source:
        J. Schoukens, M. Vaes, R. Pintelon, "Linear System Identification in a
        Nonlinear Setting", IEEE Control Systems Magazine 36(3), 2016.
    """
    top = min(HIGHEST_HZ, rate_hz / 4.0)
    odd = np.arange(1, max(int(top * period_s), 7) + 1, 2)
    groups = np.arange(odd.size) // 4
    silent = [int(rng.choice(np.flatnonzero(groups == g))) for g in range(groups[-1])]
    return np.delete(odd, silent).astype(float)


def _levels(levels, seconds: float, rate_hz: float) -> Float[np.ndarray, " n"]:
    rows = round(seconds * rate_hz)
    return levels[np.arange(rows) * len(levels) // rows]


def _smooth(wave, seconds: float, rate_hz: float) -> Float[np.ndarray, " n"]:
    """Replaces jumps by ramps of a length."""
    width = max(round(seconds * rate_hz), 1)
    padded = np.concatenate([np.zeros(width - 1), wave])
    return np.convolve(padded, np.ones(width) / width, "valid")


def _fitted(wave, seconds: float, rate_hz: float) -> Float[np.ndarray, " n"]:
    """Makes up for rounding of parts to rows."""
    rows = round(seconds * rate_hz)
    return np.pad(wave[:rows], (0, max(rows - len(wave), 0)))


WAVES: Mapping[str, Wave] = {
    "slow_triangle": Wave(
        _triangles(1), 1.0, 5.0, False, "friction, play and gravity over the range"
    ),
    "small_triangle": Wave(
        _triangles(2), 0.06, 4.0, False, "play, dead zones and presliding at reversals"
    ),
    "ramps": Wave(_ramps, 0.6, 15.0, False, "friction against speed"),
    "steps": Wave(_steps, 0.8, 8.0, True, "delay, limits of speed and torque"),
    "pulses": Wave(_pulses, 0.4, 6.0, True, "delay, damping, rest after a kick"),
    "chirp": Wave(_chirp, 0.3, 12.0, False, "gain and phase at two amplitudes"),
    "multisine": Wave(
        _multisine, 0.5, 16.0, False, "even, odd and changing nonlinearity"
    ),
    "holds": Wave(_holds, 0.9, 7.5, False, "static loads, with and without a weight"),
}
"""Kinds of excitation by name, in the order in which a plan has them."""
