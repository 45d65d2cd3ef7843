"""A type checker for jaxtyping's import hook that looks at arrays alone.

Tests pass stand-ins for parameters that are no arrays, and pytrees of data classes are
rebuilt with anything as leaves: arrays are what annotations promise.
"""

from inspect import isfunction
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


def of_arrays(jaxtyped):
    """Returns jaxtyping's decorator, whose use by the hook leaves some as they are.

    Nothing of functions without arrays is checked, but each of their calls would take
    a dozen microseconds, and a diagnosis has half a million.
    """

    def decorator(*function, typechecker):
        if function:  # not the hook: it makes a decorator of a checker alone
            return jaxtyped(*function, typechecker=typechecker)

        def decorate(thing):
            if isfunction(thing) and not promises_arrays(thing):
                return thing
            return jaxtyped(thing, typechecker=typechecker)

        return decorate

    return decorator


def promises_arrays(function):
    """Whether an annotation of a function has an array; text may be one."""
    hints = function.__annotations__.values()
    return any(isinstance(hint, str) or has_array(hint) for hint in hints)


def has_array(hint):
    """Whether a hint is an array's, or contains one."""
    if isinstance(hint, type) and issubclass(hint, AbstractArray):
        return True
    return any(has_array(inner) for inner in get_args(hint))
