"""Records of one joint on an even time grid, as the fits read them.

Angle and effort pass the same zero-phase smoothing, so linear relations between them
stay exact; the target keeps its edges; where a reading is missing for long, the
samples around do not count, and where the clock jumps, a new piece begins.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from envs.errors import InputError
from sysid.diagnosis.measured.resampling import (
    LOST,
    SMOOTH_STEPS,
    error_between,
    held_targets,
    read_between,
    shares,
    smoothed,
)
from sysid.drive import JointDrive
from sysid.logs.log import MeasuredLog

GRID_S = 0.004
"""Step that a grid does not go much below [s]; slower logs keep their own."""

SLOW_S = 0.03
"""Rows further apart than this do not show what a servo does with a target [s]."""

FINER = 4
"""Steps of the grid between two rows of such a log: each row is looked at once."""

MOST_LOST = 5.5
"""Rows further apart than this may not be a whole number of periods apart [rows]."""

MAX_FILL_S = 0.3
"""Longest stretch without a reading that is bridged by a straight line [s]."""

FORGOTTEN_S = 0.25
"""Time after which a target that was not logged no longer acts [s]."""

SHARED = 0.9
"""Share of the targets' rows with an angle above which the rows belong to both."""

EDGE = 3
"""Steps of the grid within which the smoothing still sees what was before [steps]."""

MIN_PIECE_S = 1.5
"""Shorter pieces of a record are left out [s]."""

MAX_BACKWARD = 0.01
"""Share of steps into the past above which a clock cannot be used."""


@dataclass(frozen=True, eq=False)
class Piece:
    """One stretch of one record without a jump of the clock, all joints (j).

    Attributes:
        log: index of the record that it is from.
        t_s: times of the grid [s].
        cmd: target, mean over the step that ends here [rad or m].
        held, sent: the last targets, in their order, and when they were sent before the
            end of the step [steps].
        every: readings in a step.
        row_s: time between two readings [s].
        pos: encoder angle, smoothed.
        unread: how far that angle may err where it was not read, before smoothing; not
            of a slow log, which is looked at in its rows.
        vel, acc: first and second derivative of `pos`.
        effort: effort in the unit of its column, smoothed; NaN if not logged.
        ext: known push from outside in its unit; zero without.
        valid: where readings support the values.
        resumed: where targets are known again that were not, and a simulation that did
            not know them begins anew.
    """

    log: int
    t_s: Float[np.ndarray, " n"]
    cmd: Float[np.ndarray, "n j"]
    held: Float[np.ndarray, "n s j"]
    sent: Float[np.ndarray, "n s j"]
    every: int
    row_s: float
    pos: Float[np.ndarray, "n j"]
    unread: Float[np.ndarray, "n j"]
    vel: Float[np.ndarray, "n j"]
    acc: Float[np.ndarray, "n j"]
    effort: Float[np.ndarray, "n j"]
    ext: Float[np.ndarray, "n j"]
    valid: Bool[np.ndarray, "n j"]
    resumed: Bool[np.ndarray, "n j"]


def grid_step_s(logs: Sequence[MeasuredLog], joints: Sequence[str]) -> float:
    """Returns the step of the common grid: a whole number of sampling periods [s]."""
    names = [f"pos.{joint}" for joint in joints]
    period = max(_period_s(log, n) for log in logs for n in names)
    if period > SLOW_S:
        return period / FINER
    return period * max(1, round(GRID_S / period))


def _period_s(log: MeasuredLog, name: str) -> float:
    """Slope of the times over the numbers of their rows, which jitter hardly changes.

    A grid that is too wide by 1e-4 drifts by milliseconds against the rows. Behind a
    longer gap the rows may have begun anew: only slopes between gaps count.
    """
    t_s, _ = log.samples(name)
    steps = np.diff(t_s) / log.timing(name).period_s
    kept = np.append(True, steps > 0.0)
    rows = np.append(0.0, np.cumsum(np.round(steps)))
    part = np.append(0, np.cumsum((steps > MOST_LOST) | (steps < 0.0)))
    number = np.bincount(part, kept)
    row, time = (
        x - (np.bincount(part, kept * x) / np.maximum(number, 1))[part]
        for x in (rows, t_s)
    )
    return float(np.sum(kept * row * time) / np.sum(kept * row**2))


def pieces_of(
    log: MeasuredLog, index: int, drives: Mapping[str, JointDrive], step_s: float
) -> list[Piece]:
    """Puts a record on a grid.

    Args:
        log: the record.
        index: its place among the records.
        drives: the simulation as it stands, by joint.
        step_s: step of the grid [s].

    Returns:
        Its pieces, without those that are too short.
    """
    pieces = []
    periods = [log.timing(f"pos.{joint}").period_s for joint in drives]
    every = max(1, round(step_s / min(periods)))
    for start, stop in _spans(log, f"pos.{next(iter(drives))}"):
        if stop - start >= MIN_PIECE_S:
            parts = [
                _joint(log, j, drives[j], start, stop, step_s, every) for j in drives
            ]
            kept = [part for part in parts if part is not None]
            if len(kept) == len(parts):
                stacked = {k: np.stack([p[k] for p in kept], -1) for k in kept[0]}
                t_s = start + step_s * np.arange(len(stacked["pos"]))
                pieces.append(
                    Piece(index, t_s, every=every, row_s=min(periods), **stacked)
                )
    return pieces


def _spans(log: MeasuredLog, name: str) -> list[tuple[float, float]]:
    """Returns (first, last) time of every stretch in which the clock runs evenly."""
    t_s, _ = log.samples(name)
    found = log.timing(name)
    if found.backward.size > MAX_BACKWARD * len(t_s):
        share = f"{found.backward.size} of {len(t_s)} steps into the past"
        raise InputError(log.source, "t", share, "times that increase")
    spans = []
    for part in found.parts:
        times = t_s[part]
        gaps = np.flatnonzero(np.diff(times) > MAX_FILL_S + found.period_s)
        edges = [0, *(gaps + 1), len(times)]
        for low, high in itertools.pairwise(edges):
            spans.append((float(times[low]), float(times[high - 1])))
    return _joined(spans, found.period_s)


def _joined(spans: list, period_s: float) -> list[tuple[float, float]]:
    """Joins stretches with a hole that is short enough to be bridged."""
    joined = [spans[0]]
    for start, stop in spans[1:]:
        if 0.0 <= start - joined[-1][1] <= MAX_FILL_S + period_s:
            joined[-1] = (joined[-1][0], stop)
        else:
            joined.append((start, stop))
    return joined


def _joint(log, joint, drive, start, stop, step_s, every) -> dict | None:
    """Puts one joint of one stretch on the grid."""
    names = {"cmd": f"cmd.{joint}", "pos": f"pos.{joint}"}
    names |= {"effort": f"{drive.effort}.{joint}", "ext": f"ext.{joint}"}
    names = {key: name for key, name in names.items() if name in log.columns}
    period = log.timing(names["pos"]).period_s
    fine_s = step_s / every
    fine = start + fine_s * np.arange(int((stop - start) / step_s) * every + 1)
    columns, valid, silences = {}, np.ones(len(fine), bool), []
    held = sent = np.zeros((len(fine), 1))
    unread = np.zeros(len(fine[::every]))
    for key, name in names.items():
        t_s, values = _once(*log.samples(name))
        inside = (t_s >= start - MAX_FILL_S) & (t_s <= stop + MAX_FILL_S)
        if inside.sum() < 10:
            return None
        t_s, values = t_s[inside], values[inside]
        if key == "cmd":
            held, sent = held_targets(t_s, values, fine[::every], 2 * every + 2)
            speed = drive.parameter("slew_limit", "speed_rad_s", np.inf)
            silences += _unlogged_targets(t_s, values, LOST * period, speed)
            silences += _switched_off(log, name, names["pos"])
        else:
            columns[key] = read_between(t_s, values, fine, period)
            valid &= _near(t_s, fine, LOST * period)
            if key == "pos" and step_s > 0.5 * period:  # else rows are steps of it
                unread = error_between(t_s, values, fine[::every], period)
    resumed = np.zeros(len(fine[::every]), bool)
    for since, back, until in silences:
        valid &= (fine <= since) | (fine >= until)
        if start < back < stop - EDGE * step_s:
            resumed[int((back - start) / step_s) + EDGE] = True
    sigma = SMOOTH_STEPS * every
    smooth = {k: smoothed(v, sigma)[::every] for k, v in columns.items()}
    slope = [smoothed(columns["pos"], sigma, k)[::every] for k in (1, 2)]
    none = np.full(len(fine[::every]), np.nan)
    return {
        "cmd": np.sum(held * shares(sent), 1),
        "held": held,
        "sent": sent,
        "pos": smooth["pos"],
        "unread": unread,
        "vel": slope[0] / fine_s,
        "acc": slope[1] / fine_s**2,
        "effort": smooth.get("effort", none),
        "ext": smooth.get("ext", np.zeros(len(none))),
        "valid": valid[::every],
        "resumed": resumed,
    }


def _once(t_s: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns readings at increasing times; of several at one time the last."""
    order = np.argsort(t_s, kind="stable")
    t_s, values = t_s[order], values[order]
    last = np.append(np.diff(t_s) > 0.0, True)
    return t_s[last], values[last]


def _unlogged_targets(
    t_s: np.ndarray, values: np.ndarray, within_s: float, speed: float
) -> list[tuple[float, float, float]]:
    """When targets may have been sent that are not in the record: from, to, act until.

    Behind a limit of the speed a target acts until it is reached.
    """
    silent = np.diff(t_s) > within_s
    moved = silent & (np.diff(values) != 0.0)
    found = []
    for k in np.flatnonzero(moved):
        underway_s = abs(values[k + 1] - values[k]) / speed
        back = float(t_s[k + 1])
        found.append((float(t_s[k]), back, back + FORGOTTEN_S + float(underway_s)))
    return found


def _switched_off(
    log: MeasuredLog, cmd: str, pos: str
) -> list[tuple[float, float, float]]:
    """When a record that has targets in the rows of its angles has none for long.

    There the servo was switched off. Where targets have rows of their own, as messages
    have, silence says that the last one holds.
    """
    sent, read = (np.isfinite(log.columns[name]) for name in (cmd, pos))
    if np.mean(read[sent]) < SHARED:
        return []
    sent_s = np.append(np.sort(log.t_s[sent]), np.inf)
    alone_s = log.t_s[read & ~sent]
    found = []
    for start, stop in itertools.pairwise(sent_s.tolist()):
        between = np.any((alone_s > start) & (alone_s < stop))
        if stop - start > FORGOTTEN_S and between:
            found.append((start, stop, stop + FORGOTTEN_S))
    return found


def _near(t_s: np.ndarray, grid: np.ndarray, within_s: float) -> np.ndarray:
    """At which points of the grid both neighbours are near."""
    after = np.clip(np.searchsorted(t_s, grid), 1, len(t_s) - 1)
    return (t_s[after] - t_s[after - 1] <= within_s) | np.isin(grid, t_s)
