"""Errors that a user can cause: one sentence each, exit status 2."""

from fingers_deploy.errors import InputError as InputError
from fingers_deploy.errors import one_of as one_of

BAD_INPUT = 2
"""Exit status of a command that was given something it cannot take."""


def check_ordered(config: object, *names: str) -> None:
    """Checks fields that are ranges (low, high).

    Raises:
        InputError: the low end of a range is above its high end.
    """
    for name in names:
        low, high = getattr(config, name)
        if low > high:
            found, valid = f"[{low:g}, {high:g}]", "[low, high] with low <= high"
            raise InputError("configuration", name, found, valid)
