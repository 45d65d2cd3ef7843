"""Configurations by search: combinations of a grid, or random samples of a space."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from envs.config.typed import limits
from envs.errors import InputError

Scalar = bool | int | float | str | None
Value = Scalar | tuple[Scalar, ...]
Overrides = dict[str, Value]
"""Settings by dotted name, as `fingers train --set` names them."""

MAX_CONFIGURATIONS = 4096


@dataclass(frozen=True)
class Range:
    """Numbers from `low` to `high`, uniform, or uniform in their logarithm.

    Raises:
        InputError: the ends are in the wrong order, or one has no logarithm.
    """

    low: float
    high: float
    log: bool = False

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise InputError("range", "high", self.high, f"above low ({self.low:g})")
        if self.log and self.low <= 0.0:
            raise InputError("range", "low", self.low, "above 0, as log is true")


@dataclass(frozen=True)
class Search:
    """Random search.

    Attributes:
        space: setting to a range, or to the list of its values.
        samples: number of configurations; more of them keep those before.
        seed: of the samples.
    """

    space: dict[str, Range | tuple[Value, ...]]
    samples: int = field(default=24, metadata=limits("1", 1, MAX_CONFIGURATIONS))
    seed: int = field(default=0, metadata=limits("1", 0, 2**32 - 1))

    def __post_init__(self) -> None:
        if not self.space:
            raise InputError("search", "space", "no setting", "one or more")
        for name, values in self.space.items():
            if values == ():
                raise InputError("search", f"space.{name}", "no value", "one or more")


Grid = dict[str, tuple[Value, ...]]
"""Setting to the list of its values."""


def sampled(search: Search) -> dict[str, Overrides]:
    """Returns the samples `sample-00`, `sample-01`, … of a search.

    Each has a generator of its own, made from (seed, number), so that sample n is the
    same in a search of any size.
    """
    found = {}
    for number in range(search.samples):
        draw = np.random.default_rng((search.seed, number))
        values = {name: _drawn(draw, of) for name, of in search.space.items()}
        found[f"sample-{number:02d}"] = values
    return found


def gridded(grid: Mapping[str, tuple[Value, ...]]) -> dict[str, Overrides]:
    """Returns all combinations `grid-00`, `grid-01`, …; the last name changes fastest.

    Raises:
        InputError: there are too many, or a setting has no value.
    """
    number = math.prod(map(len, grid.values()))
    if not 1 <= number <= MAX_CONFIGURATIONS:
        valid = f"1 to {MAX_CONFIGURATIONS}"
        raise InputError("grid", "grid", f"{number} combinations", valid)
    combinations = itertools.product(*grid.values())
    return {
        f"grid-{number:02d}": dict(zip(grid, values, strict=True))
        for number, values in enumerate(combinations)
    }


def _drawn(draw: np.random.Generator, values: Range | tuple[Value, ...]) -> Value:
    """Returns one value, as a plain number."""
    if isinstance(values, tuple):
        return values[draw.integers(len(values))]
    if values.log:
        low, high = math.log(values.low), math.log(values.high)
        return math.exp(draw.uniform(low, high))
    return float(draw.uniform(values.low, values.high))
