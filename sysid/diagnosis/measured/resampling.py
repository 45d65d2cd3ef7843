"""Signals on an even grid: smoothed with derivatives, targets held between messages."""

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

SMOOTH_STEPS = 0.8
"""Width of the smoothing of all channels [steps of the grid]."""

AT_ONCE = 1e-4
"""A target so near to a reading was sent with it: rounding decides nothing [steps]."""

LONG_AGO = 1e6
"""Age of a target of which nothing is known [steps]."""

LOST = 1.6
"""Distance of readings above which one is missing between them [periods]."""

BURST = 0.3
"""Distance of readings below which their difference shows no slope [periods]."""

AROUND = (-3, -1, 1, 3)
"""Rows about a row by which a cubic guesses it: half as many as there are."""


def smoothed(
    x: Float[np.ndarray, " n"], sigma: float, order: int = 0
) -> Float[np.ndarray, " n"]:
    """A Gaussian mean over the samples, or a derivative of it.

        Y(ω) = X(ω) (iω)ᵏ exp(−ω² σ² / 2)

    The record is continued by its point reflection at both ends, so value and slope
    stay continuous there.

    Args:
        x: evenly sampled signal, of any unit.
        sigma: width σ [steps].
        order: k, of the derivative per sample.

    Returns:
        The signal in its unit, or per step to the power of k.

    Source:
        Zero-phase Gaussian filter, applied by its Fourier transform.
    """
    pad = min(len(x) - 1, int(6 * sigma) + 8)
    head, tail = 2 * x[0] - x[pad:0:-1], 2 * x[-1] - x[-2 : -pad - 2 : -1]
    wide = np.concatenate([head, x, tail])
    ends = np.linspace(wide[0], wide[-1], len(wide))
    slope = (wide[-1] - wide[0]) / (len(wide) - 1)
    omega = 2.0 * np.pi * np.fft.rfftfreq(len(wide))
    gain = (1j * omega) ** order * np.exp(-0.5 * (omega * sigma) ** 2)
    out = np.fft.irfft(np.fft.rfft(wide - ends) * gain, len(wide))
    out += (ends, slope, 0.0)[order]
    return out[pad : pad + len(x)]


def read_between(
    t_s: Float[np.ndarray, " m"],
    x: Float[np.ndarray, " m"],
    grid: Float[np.ndarray, " n"],
    period_s: float,
) -> Float[np.ndarray, " n"]:
    """Readings at the times of a grid, on a cubic spline through their rows.

    On a straight line an angle with the acceleration a that is read h apart errs by up
    to a h² / 8 between its rows, and a record whose rows jitter has its grid there.

    Args:
        t_s: times of readings, increasing [s].
        x: readings, of any unit.
        grid: times [s]; before the first and after the last reading counts that one.
        period_s: h [s]. Where a reading is missing a straight line bridges the gap, and
            of several at almost one time the first counts.

    Returns:
        Values at the grid, in the unit of the readings.

    Source:
        Cubic spline interpolation: C. de Boor, A Practical Guide to Splines, 1978.
    """
    read = np.interp(grid, t_s, x)
    apart = np.diff(t_s, prepend=-np.inf)
    for rows in np.split(np.arange(len(t_s)), np.flatnonzero(apart > LOST * period_s)):
        knots = rows[apart[rows] > BURST * period_s]
        if len(knots) > 3:
            inside = (grid >= t_s[knots[0]]) & (grid <= t_s[knots[-1]])
            read[inside] = CubicSpline(t_s[knots], x[knots])(grid[inside])
    return read


def error_between(
    t_s: Float[np.ndarray, " m"],
    x: Float[np.ndarray, " m"],
    grid: Float[np.ndarray, " n"],
    period_s: float,
) -> Float[np.ndarray, " n"]:
    """How far `read_between` may err, by how far half of the rows would.

        u = f (1 − f) max(|r_i|, |r_{i+1}|),   r_i = x_i − c_i(t_i)

    at the share f of the way from row i to the next; c_i is the cubic through the rows
    one and three away on either side. Where the acceleration jumps, as where a servo
    takes a step, a curve errs by the square of the distance of its rows: half as far
    apart by a quarter of r in the middle, where f (1 − f) is a quarter. At the rows
    themselves nothing is lost, and where the motion is smooth hardly anything.

    Args:
        t_s: times of readings, increasing [s].
        x: readings, of any unit.
        grid: times [s].
        period_s: time between readings [s]; of several at almost one time the first
            counts.

    Returns:
        u ≥ 0, in the unit of the readings; zero within three rows of both ends. Of a
        gap that a straight line bridges it says nothing.

    Source:
        Ours; an error by what twice the step errs, as of L. F. Richardson, The Deferred
        Approach to the Limit, Philosophical Transactions A 226, 1927.
    """
    knots = np.diff(t_s, prepend=-np.inf) > BURST * period_s
    t_s, x = t_s[knots], x[knots]
    row = np.arange(3, len(t_s) - 3)
    missed = np.zeros(len(t_s))
    missed[row] = x[row]
    for a in AROUND:
        share = np.ones(len(row))
        for b in AROUND:
            if b != a:
                share *= (t_s[row] - t_s[row + b]) / (t_s[row + a] - t_s[row + b])
        missed[row] -= share * x[row + a]
    before = np.clip(np.searchsorted(t_s, grid, "right") - 1, 0, len(t_s) - 2)
    f = np.clip((grid - t_s[before]) / np.diff(t_s)[before], 0.0, 1.0)
    size = np.maximum(np.abs(missed[before]), np.abs(missed[before + 1]))
    return f * (1.0 - f) * size


def held_targets(
    t_s: Float[np.ndarray, " m"],
    values: Float[np.ndarray, " m"],
    grid: Float[np.ndarray, " n"],
    slots: int,
) -> tuple[Float[np.ndarray, "n s"], Float[np.ndarray, "n s"]]:
    """The last targets before the ends of steps, and when they were sent.

    At time t acts the last target sent, x(t) = x_i with t_i ≤ t < t_{i+1}.

    Args:
        t_s: times at which targets were sent, increasing [s].
        values: x, the targets [rad].
        grid: ends of the steps, evenly spaced [s].
        slots: number of targets that are returned.

    Returns:
        Targets in their order [rad], and their times less the end of the step, at most
        zero [steps]. The first target counts as sent long before.

    Source:
        Ours: servos hold a target until the next message.
    """
    step_s = grid[1] - grid[0]
    last = np.searchsorted(t_s, grid, "right") - 1
    index = last[:, None] - np.arange(slots - 1, -1, -1)
    known = np.clip(index, 0, len(t_s) - 1)
    start = np.where(index > 0, t_s[known], -np.inf)
    sent = np.maximum((start - grid[:, None]) / step_s, -LONG_AGO)
    return values[known], np.where(sent > -AT_ONCE, 0.0, sent)


def shares(sent: Float[np.ndarray, "n s"]) -> Float[np.ndarray, "n s"]:
    """Shares of a step for which targets were held: a_i = b_{i+1} − b_i.

    With beginnings b_i = min(max(t_i + 1, 0), 1), b_0 = 0 and b_{s} = 1.

    Args:
        sent: t, when targets were sent before the end of the step, ≤ 0 [steps].

    Returns:
        a ≥ 0, which add up to 1 [1].

    Source:
        Ours; zero-order hold.
    """
    begin = np.clip(sent + 1.0, 0.0, 1.0)
    begin[:, 0] = 0.0
    return np.diff(begin, append=1.0)
