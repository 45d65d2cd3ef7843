"""What a measurement finds: figures with intervals, or reasons why there are none."""

import math
import statistics
from dataclasses import dataclass

from scipy import stats

from benchmarks.comparison.plan import Worker

LEVEL = 0.95


@dataclass(frozen=True)
class Figure:
    """What was found of one worker; `value` is None where `note` says why."""

    quantity: str
    unit: str
    value: float | None
    low: float | None
    high: float | None
    version: str
    note: str


Found = list[tuple[Worker, Figure]]


def interval(values: list[float]) -> tuple[float, float, float]:
    """Returns the geometric mean of positive figures and its interval of 95 %.

    One figure alone is its own interval.

    Source:
        Student's t interval of the logarithms.
    """
    logs = [math.log(x) for x in values]
    middle = statistics.mean(logs)
    if len(logs) < 2:
        return math.exp(middle), math.exp(middle), math.exp(middle)
    error = statistics.stdev(logs) / math.sqrt(len(logs))
    half = float(stats.t.ppf(0.5 + LEVEL / 2, len(logs) - 1)) * error
    return math.exp(middle), math.exp(middle - half), math.exp(middle + half)


def none(quantity: str, unit: str, why: str) -> Figure:
    """Returns the place of a figure that could not be taken."""
    return Figure(quantity, unit, None, None, None, "", f"not measured: {why}")
