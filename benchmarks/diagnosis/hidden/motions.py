"""Targets as people send them who did not plan to identify anything."""

import numpy as np

from benchmarks.diagnosis.hidden.recording import Recording

MOTIONS = ("sines", "steps", "moves", "wander")

FADE_S = 0.5
"""Time in which a motion begins at and returns to the middle [s]."""


def user_motion(
    rng: np.random.Generator,
    name: str,
    middle: np.ndarray,
    reach: np.ndarray,
    rate_hz: float,
    round_s: float,
) -> Recording:
    """Makes one round of a motion; every joint that moves does its own.

    Args:
        rng: draws everything.
        name: one of `MOTIONS`.
        middle: angle about which each joint moves [rad].
        reach: largest excursion of each joint, 0 for one that holds [rad].
        rate_hz: rows in a second.
        round_s: length of the round [s].
    """
    rows = round(round_s * rate_hz)
    t_s = np.arange(rows) / rate_hz
    waves = [size * _WAVES[name](rng, t_s) if size else 0.0 * t_s for size in reach]
    targets = np.stack(waves, 1) + middle
    return Recording(rate_hz, targets, ((name, 0, 0, rows),))


def _faded(wave: np.ndarray, t_s: np.ndarray) -> np.ndarray:
    """Begins and ends at zero."""
    ends = np.minimum(t_s, t_s[-1] - t_s) / FADE_S
    return wave * np.clip(ends, 0.0, 1.0)


def _sines(rng: np.random.Generator, t_s: np.ndarray) -> np.ndarray:
    """Two or three of 0.2 to 1.5 Hz."""
    count = int(rng.integers(2, 4))
    hertz, phase = rng.uniform(0.2, 1.5, count), rng.uniform(0.0, 2.0 * np.pi, count)
    size = rng.dirichlet(np.full(count, 3.0))
    wave = size @ np.sin(2.0 * np.pi * np.outer(hertz, t_s) + phase[:, None])
    return _faded(wave, t_s)


def _steps(rng: np.random.Generator, t_s: np.ndarray) -> np.ndarray:
    """Somebody clicks: levels that are held for 0.4 to 2 s."""
    times = np.cumsum(rng.uniform(0.4, 2.0, int(t_s[-1] / 0.4) + 2))
    levels = rng.uniform(-1.0, 1.0, len(times) + 1)
    levels[0] = 0.0
    wave = levels[np.searchsorted(times, t_s)]
    return np.where(t_s > t_s[-1] - FADE_S, 0.0, wave)


def _moves(rng: np.random.Generator, t_s: np.ndarray) -> np.ndarray:
    """Picks and places: moves of least jerk between places, with pauses."""
    wave, now, at = np.zeros_like(t_s), 0.3, 0.0
    while now < t_s[-1] - 2.0:
        lasts, to = rng.uniform(0.4, 1.4), rng.uniform(-1.0, 1.0)
        wave = wave + (to - at) * _least_jerk((t_s - now) / lasts)
        now, at = now + lasts + rng.uniform(0.2, 1.0), to
    return wave - at * _least_jerk((t_s - t_s[-1] + 1.5) / 1.2)


def _least_jerk(s: np.ndarray) -> np.ndarray:
    """10 s³ − 15 s⁴ + 6 s⁵ between 0 and 1."""
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def _wander(rng: np.random.Generator, t_s: np.ndarray) -> np.ndarray:
    """A hand on a joystick: noise below 1.5 Hz."""
    lines = np.arange(1, int(1.5 * t_s[-1]) + 1)
    phase = rng.uniform(0.0, 2.0 * np.pi, lines.size)
    turns = np.outer(lines / t_s[-1], t_s)
    wave = rng.normal(size=lines.size) @ np.sin(2.0 * np.pi * turns + phase[:, None])
    return _faded(wave / np.max(np.abs(wave)), t_s)


_WAVES = {"sines": _sines, "steps": _steps, "moves": _moves, "wander": _wander}
