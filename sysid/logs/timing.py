"""When a log was sampled: rate, jitter, gaps, repeated and backward times."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from envs.errors import InputError
from sysid.logs.log import MeasuredLog

GAP_FACTOR = 2.5


@dataclass(frozen=True, eq=False)
class Timing:
    """Sampling of one stream; indices i name the step from sample i to i + 1.

    Attributes:
        samples: number of samples.
        span_s: last time less first time [s].
        period_s: median of the forward steps [s].
        jitter_s: deviation of the steps that are no gap [s].
        gaps: steps longer than `GAP_FACTOR` periods.
        repeated: steps of zero length.
        backward: steps into the past.
    """

    samples: int
    span_s: float
    period_s: float
    jitter_s: float
    gaps: Int[np.ndarray, " a"]
    repeated: Int[np.ndarray, " b"]
    backward: Int[np.ndarray, " c"]

    @property
    def regular(self) -> bool:
        """Whether there is no gap, no repeated and no backward time."""
        return not (self.gaps.size or self.repeated.size or self.backward.size)


def timing(t_s: Float[np.ndarray, " n"], source: object = "log") -> Timing:
    """Describes the times of a stream, at least two, in recorded order.

    Raises:
        InputError: no step goes forward, so there is no period.
    """
    steps = np.diff(t_s)
    forward = steps[steps > 0.0]
    if not forward.size:
        raise InputError(source, "t", "no step forward", "times that increase")
    period = float(np.median(forward))
    usual = forward[forward <= GAP_FACTOR * period]
    return Timing(
        samples=len(t_s),
        span_s=float(t_s[-1] - t_s[0]),
        period_s=period,
        jitter_s=float(np.std(usual)),
        gaps=np.flatnonzero(steps > GAP_FACTOR * period),
        repeated=np.flatnonzero(steps == 0.0),
        backward=np.flatnonzero(steps < 0.0),
    )


def column_timing(log: MeasuredLog, name: str) -> Timing:
    """Describes when one column was read; its missing rows are no samples.

    Raises:
        InputError: no such column, or fewer than two readings at different times.
    """
    t_s, _ = log.samples(name)
    if len(t_s) < 2:
        raise InputError(log.source, name, f"{len(t_s)} reading", "at least two")
    return timing(t_s, log.source)


def continuous_parts(t_s: Float[np.ndarray, " n"]) -> list[slice]:
    """Splits a stream where its clock jumps: after gaps and before backward times.

    Repeated times stay inside their part.
    """
    found = timing(t_s)
    cuts = np.sort(np.concatenate([found.gaps, found.backward])) + 1
    edges = [0, *cuts.tolist(), len(t_s)]
    return [slice(a, b) for a, b in pairwise(edges)]


def resampled(
    log: MeasuredLog, name: str, t_s: Float[np.ndarray, " m"]
) -> Float[np.ndarray, " m"]:
    """Reads a column at other times: linear inside continuous parts, NaN elsewhere.

    Of several readings at one time the last one counts.

    Args:
        log: the log.
        name: column.
        t_s: times to read it at [s].

    Raises:
        InputError: no such column, or times that run backward, where "the value at
            time t" has no meaning.
    """
    times, values = log.samples(name)
    found = column_timing(log, name)
    if found.backward.size:
        when = f"a step back at {times[found.backward[0]]:.6g} s"
        raise InputError(log.source, "t", when, "times that never run backward")
    result = np.full(len(t_s), np.nan)
    for part in continuous_parts(times):
        last = np.append(np.diff(times[part]) > 0.0, True)
        part_t, part_v = times[part][last], values[part][last]
        inside = (t_s >= part_t[0]) & (t_s <= part_t[-1])
        result[inside] = np.interp(t_s[inside], part_t, part_v)
    return result
