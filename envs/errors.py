"""Errors that a user can cause: one sentence each, exit status 2."""

import difflib
from collections.abc import Iterable

BAD_INPUT = 2
"""Exit status of a command that was given something it cannot take."""


class InputError(ValueError):
    """Bad input: one sentence names the place, what was found and what is valid.

    Args:
        source: file, command-line option or argument in which the value stands.
        field: the field inside `source`, dotted; empty when the source as a whole is
            at fault.
        found: what was found there.
        valid: what would have been valid.
    """

    def __init__(self, source: object, field: str, found: object, valid: str):
        self.source, self.field, self.found, self.valid = source, field, found, valid
        where = f"{source}: {field}" if field else f"{source}"
        super().__init__(f"{where}: found {_short(found)}; valid: {valid}")


def _short(value: object, limit: int = 120) -> str:
    """Returns `value` on one line, shortened to `limit` characters."""
    text = " ".join(str(value).split()) or "nothing"
    return text if len(text) <= limit else text[: limit - 1] + "…"


def one_of(names: Iterable[str], found: str = "") -> str:
    """Lists valid names, the one nearest to `found` first."""
    listed = list(names)
    near = difflib.get_close_matches(found, listed, n=1)
    hint = f" (did you mean {near[0]}?)" if near else ""
    return "one of " + ", ".join(listed) + hint


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
