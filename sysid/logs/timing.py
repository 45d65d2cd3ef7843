"""When a log was sampled: rate, jitter, gaps, repeated and backward times."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from envs.errors import InputError

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

    @property
    def parts(self) -> list[slice]:
        """Samples without a jump of the clock: cut at gaps and backward steps.

        Repeated times stay inside their part.
        """
        cuts = np.sort(np.concatenate([self.gaps, self.backward])) + 1
        edges = [0, *cuts.tolist(), self.samples]
        return [slice(a, b) for a, b in pairwise(edges)]


def timing(t_s: Float[np.ndarray, " n"], source: object = "log") -> Timing:
    """Δ = median {t_{i+1} − t_i > 0}, the period of a stream, and what departs from it.

    Args:
        t_s: times of at least two samples, in recorded order [s].
        source: for messages.

    Raises:
        InputError: no step goes forward, so there is no period.

    Source:
        Ours: the median ignores gaps, as long as fewer than half of the steps are gaps.

    Examples:
        >>> found = timing(np.array([0.0, 0.1, 0.2, 0.7, 0.8]))
        >>> found.regular, round(found.period_s, 3), found.parts
        (False, 0.1, [slice(0, 3, None), slice(3, 5, None)])
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
