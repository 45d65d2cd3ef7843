"""Targets of the standard recording, made without the product's planner.

One round moves a joint through slow and small triangles, steps, chirps of two sizes,
an odd random-phase multisine and holds; rounds are repeated exactly.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Recording:
    """Targets and when they are sent.

    Attributes:
        rate_hz: rows in a second.
        targets: rows by joints [rad].
        parts: (name, round, first row, row after the last).
    """

    rate_hz: float
    targets: np.ndarray
    parts: tuple[tuple[str, int, int, int], ...]

    @property
    def round_rows(self) -> int:
        """Rows of one round."""
        return len(self.targets) // (1 + max(part[1] for part in self.parts))


def standard(
    rng: np.random.Generator,
    middle: np.ndarray,
    reach: np.ndarray,
    rate_hz: float = 200.0,
    round_s: float = 15.0,
    rounds: int = 3,
) -> Recording:
    """Makes the standard recording; joints that move beside others do other things.

    Args:
        rng: draws steps and phases.
        middle: angle about which each joint moves [rad].
        reach: largest excursion of each joint, 0 for one that holds [rad].
        rate_hz: rows in a second.
        round_s: length of a round [s].
        rounds: how often the round is repeated.
    """
    share = {
        "slow_triangle": 0.25,
        "small_triangle": 0.13,
        "steps": 0.2,
        "chirp": 0.16,
        "multisine": 0.16,
        "holds": 0.1,
    }
    names = list(share)
    rows = {name: round(x * round_s * rate_hz) for name, x in share.items()}
    columns, parts = [], []
    alone = np.count_nonzero(reach) == 1
    for joint, amplitude in enumerate(reach):
        order = names if alone else names[joint % 6 :] + names[: joint % 6]
        made = [_SHAPES[name](rng, rows[name], rate_hz) for name in order]
        columns.append(amplitude * np.concatenate(made))
    once = np.stack(columns, 1) + middle
    edges = np.cumsum([0, *(rows[name] for name in names)])
    for number in range(rounds):
        first = number * len(once)
        parts += [
            (name, number, first + int(a), first + int(b))
            for name, a, b in zip(names, edges[:-1], edges[1:], strict=True)
        ]
    return Recording(rate_hz, np.tile(once, (rounds, 1)), tuple(parts))


def _triangle(phase: np.ndarray) -> np.ndarray:
    """0 → 1 → −1 → 0 over every unit of phase."""
    x = (phase + 0.25) % 1.0
    return 1.0 - 4.0 * np.abs(x - 0.5)


def _slow(rng, rows, rate_hz):
    return _triangle(np.arange(rows) / rows)


def _small(rng, rows, rate_hz):
    return 0.06 * _triangle(2.0 * np.arange(rows) / rows)


def _steps(rng, rows, rate_hz):
    levels = rng.permutation([1.0, -0.8, 0.4, -0.15, 0.7, -0.5])
    levels = np.append(levels, 0.0)
    return levels[np.arange(rows) * len(levels) // rows]


def _chirp(rng, rows, rate_hz):
    """0.3 to 8 Hz, first large, then a quarter of it."""
    half = rows // 2
    t = np.arange(half) / rate_hz
    low, high = 0.3, 8.0
    rate = np.log(high / low) / t[-1]
    wave = np.sin(2.0 * np.pi * low * np.expm1(rate * t) / rate)
    fade = np.minimum(1.0, 5.0 * (1.0 - t / t[-1]))
    return np.concatenate([0.6 * wave * fade, 0.15 * wave * fade, np.zeros(rows % 2)])


def _multisine(rng, rows, rate_hz):
    """Odd lines below 6 Hz of one period that fits three times."""
    t = np.arange(rows) * 3.0 / rows
    most = int(6.0 * rows / rate_hz / 3.0)
    lines = np.arange(1, max(most, 3) + 1, 2)
    phases = rng.uniform(0.0, 2.0 * np.pi, lines.size)
    wave = np.cos(2.0 * np.pi * np.outer(t, lines) + phases).sum(1)
    wave -= wave[0]
    return 0.6 * wave / np.max(np.abs(wave))


def _holds(rng, rows, rate_hz):
    levels = np.array([0.9, 0.3, -0.3, -0.9, 0.0])
    return levels[np.arange(rows) * len(levels) // rows]


_SHAPES = {
    "slow_triangle": _slow,
    "small_triangle": _small,
    "steps": _steps,
    "chirp": _chirp,
    "multisine": _multisine,
    "holds": _holds,
}
