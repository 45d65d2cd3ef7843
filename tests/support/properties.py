"""Properties that hold for any input (F7): few examples in the fast tests, 2,000 slow.

A test takes `count` by the mark `counts` and hands its check to `holds`.
"""

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, seed, settings
from hypothesis.strategies import SearchStrategy

SEED = 20260118
counts = pytest.mark.parametrize(
    "count", [150, pytest.param(2000, marks=pytest.mark.slow)]
)


def holds(count: int, check: Callable[..., None], *inputs: SearchStrategy[Any]) -> None:
    """Runs `check` on `count` examples of its inputs."""
    print(f"seed {SEED}")
    many = settings(max_examples=count, deadline=None, database=None)
    seed(SEED)(many(given(*inputs)(check)))()
