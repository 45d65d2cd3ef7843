"""The law of a servo, estimated from a record by linear least squares."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sysid.description.stretches import Stretch

DELAYS_S = (0.0, 0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.06, 0.08, 0.12)
"""Delays that are tried [s]."""

CUTOFFS_HZ = (np.inf, 30.0, 15.0, 8.0, 5.0, 3.0, 2.0, 1.0)
"""Low-passes that are tried [Hz]."""

PARTS = 5
"""Parts of the records, each of which is left out once for the standard errors."""

MOST_ROWS = 20_000
"""Rows of which an estimate is made; of longer records every so many-th."""

LEAST_ROWS = 10 * PARTS
"""Rows below which nothing is estimated."""

MORE = 1.2
"""Paths that leave so much more than the best one are as good [1]."""

STILL = 0.02
"""Share of the large speeds below which the sign of a friction is not known."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """y = X θ: θ, its standard errors, and the share of the variance of y explained."""

    theta: Float[np.ndarray, " k"]
    sd: Float[np.ndarray, " k"]
    share: float


@dataclass(frozen=True)
class Law:
    """u = kp (c − y) − kd ẏ behind a path of targets, and how well it holds.

    Attributes:
        kp: lower and upper bound of the gain, in the unit of u per rad.
        kd: of the velocity, in the unit of u per rad/s; not negative.
        kd_sd: its standard error.
        share: share of the variance of u that the law explains [1].
        delay_s, cutoff_hz: the path of the targets.
        setting: name of the setting in the headers that multiplies `kp`, or "".
    """

    kp: tuple[float, float]
    kd: float
    kd_sd: float
    share: float
    delay_s: float
    cutoff_hz: float
    setting: str = ""

    @property
    def lag_s(self) -> float:
        """How late a slow target acts [s]."""
        return self.delay_s + 1.0 / (2.0 * np.pi * self.cutoff_hz)


def regression(
    columns: Float[np.ndarray, "n k"], y: Float[np.ndarray, " n"]
) -> Estimate:
    """θ = argmin ‖y − [X 1] θ‖², with the jackknife's standard errors.

    Args:
        columns: X; the constant beside it is not returned.
        y: what is to be explained, in the order of time.

    Returns:
        θ without the constant, s_θ² = (K − 1) / K Σ_k (θ_{−k} − θ̄)² over K = `PARTS`
        parts in the order of time, and 1 − ‖y − X θ‖² / ‖y − ȳ‖².

    Source:
        Ordinary least squares; delete-a-group jackknife: J. Shao, D. Tu, The Jackknife
        and Bootstrap, 1995.

    Examples:
        >>> x = np.sin(np.arange(100.0))
        >>> found = regression(x[:, None], 2.0 * x + 1.0)
        >>> found.theta.round(6), round(found.share, 6)
        (array([2.]), 1.0)
    """
    wide = np.column_stack([columns, np.ones(len(y))])
    size = np.maximum(np.abs(wide).max(0), 1e-300)
    theta = np.linalg.lstsq(wide / size, y, rcond=None)[0]
    part = np.arange(len(y)) * PARTS // len(y)
    without = [
        np.linalg.lstsq(wide[part != k] / size, y[part != k], rcond=None)[0]
        for k in range(PARTS)
    ]
    sd = np.sqrt((PARTS - 1) * np.var(without, axis=0)) / size
    left = np.sum((y - wide / size @ theta) ** 2)
    whole = max(float(np.sum((y - y.mean()) ** 2)), 1e-300)
    return Estimate((theta / size)[:-1], sd[:-1], float(1.0 - left / whole))


def rows_of(stretches: Sequence[Stretch]) -> list[np.ndarray]:
    """Returns which steps of every stretch count, at most `MOST_ROWS` in all."""
    kept = [np.flatnonzero(s.valid) for s in stretches]
    every = 1 + sum(map(len, kept)) // MOST_ROWS
    return [rows[::every] for rows in kept]


def enough(rows: Sequence[np.ndarray]) -> bool:
    """Returns whether so many rows count that an estimate says something."""
    return sum(map(len, rows)) >= LEAST_ROWS


def friction_sign(
    vel: Float[np.ndarray, " n"], largest: float
) -> Float[np.ndarray, " n"]:
    """sat(q̇ / v₀): the sign of a speed, without that of its noise.

    Args:
        vel: q̇ [rad/s].
        largest: speed that occurs [rad/s]; v₀ is `STILL` of it.

    Source:
        Ours; smooth Coulomb friction.
    """
    return np.tanh(vel / (STILL * max(largest, 1e-12)))


def servo_law(
    stretches: Sequence[Stretch], torque: Sequence[np.ndarray], friction: bool
) -> Law | None:
    """The gains and the path of the targets that explain a torque.

    Of all paths that leave little more than the best one the fastest: a slow one and a
    small gain move a joint alike. The torque is regressed on the error of the angle and
    the error on the torque: whatever part of the deviation belongs to which, the gain
    lies between the two.

    Args:
        stretches: of the records.
        torque: u, what the drive gives in each of them, in any unit.
        friction: whether dry friction is in it, with the other sign.

    Returns:
        None where too few rows count, or the targets do not move or are the angles.

    Source:
        R. Frisch, Statistical Confluence Analysis by Means of Complete Regression
        Systems, 1934 (bounds where both sides have errors).
    """
    rows = rows_of(stretches)
    if not enough(rows):
        return None
    if np.ptp(joined([s.command(0.0, np.inf) for s in stretches], rows)) == 0.0:
        return None
    vel, y = joined([s.vel for s in stretches], rows), joined(torque, rows)
    largest = float(np.percentile(np.abs(vel), 98))
    beside = [-vel, -friction_sign(vel, largest)][: 2 if friction else 1]
    laws = [
        law
        for setting in _settings(stretches)
        for delay_s, cutoff_hz in itertools.product(DELAYS_S, CUTOFFS_HZ)
        if (law := _law(stretches, rows, (y, beside), (delay_s, cutoff_hz, setting)))
    ]
    if not laws:
        return None
    left = 1.0 - max(law.share for law in laws)
    good = [law for law in laws if 1.0 - law.share <= MORE * left]
    return min(good, key=lambda law: law.lag_s)


def _law(stretches, rows, sides, path: tuple[float, float, str]) -> Law | None:
    """The gains behind one path; None where they would pull the wrong way."""
    delay_s, cutoff_hz, setting = path
    y, beside = sides
    errors = [
        (s.settings[setting] if setting else 1.0)
        * (s.command(delay_s, cutoff_hz) - s.pos)
        for s in stretches
    ]
    error = joined(errors, rows)
    if np.ptp(error) == 0.0:
        return None
    there = regression(np.column_stack([error, *beside]), y)
    if there.theta[1] < 0.0:  # no servo drives itself faster
        beside = beside[1:]
        there = regression(np.column_stack([error, *beside]), y)
        kd = kd_sd = 0.0
    else:
        kd, kd_sd = float(there.theta[1]), float(there.sd[1])
    back = regression(np.column_stack([y, *beside]), error)
    if there.theta[0] <= 0.0 or back.theta[0] <= 0.0:
        return None
    kp = float(there.theta[0]), float(1.0 / back.theta[0])
    return Law(kp, kd, kd_sd, there.share, *path)


def _settings(stretches: Sequence[Stretch]) -> list[str]:
    """Settings that may multiply a gain: positive in all records, not alike in all."""
    names = set.intersection(*[set(s.settings) for s in stretches])
    values = {name: [s.settings[name] for s in stretches] for name in sorted(names)}
    return ["", *(n for n, v in values.items() if min(v) > 0.0 and min(v) < max(v))]


def joined(values: Sequence[np.ndarray], rows: list[np.ndarray]) -> np.ndarray:
    """Returns the rows that count of all stretches, one after the other."""
    return np.concatenate([v[r] for v, r in zip(values, rows, strict=True)])
