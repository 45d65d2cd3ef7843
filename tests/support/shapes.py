"""A type checker for jaxtyping's import hook that looks at arrays alone.

Tests pass stand-ins for parameters that are no arrays, and pytrees of data classes are
rebuilt with anything as leaves: arrays are what annotations promise.
"""

from typing import get_args

from beartype import beartype
from jaxtyping import AbstractArray


def check_arrays(function):
    """Returns a function whose arrays are checked against its annotations."""
    if function.__name__ == "__init__":
        return function
    hints = function.__annotations__
    function.__annotations__ = {n: h for n, h in hints.items() if has_array(h)}
    return beartype(function)


def has_array(hint):
    """Whether a hint is an array's, or contains one."""
    if isinstance(hint, type) and issubclass(hint, AbstractArray):
        return True
    return any(has_array(inner) for inner in get_args(hint))
