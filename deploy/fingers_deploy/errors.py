"""Errors that a user can cause: input that is refused in one sentence."""

import difflib
from collections.abc import Iterable


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


class BundleError(InputError):
    """A policy bundle that cannot be honoured."""


def one_of(names: Iterable[str], found: str = "") -> str:
    """Lists valid names, and the one that `found` was probably meant to be."""
    listed = list(names)
    near = difflib.get_close_matches(found, listed, n=1)
    hint = f" (did you mean {near[0]}?)" if near else ""
    return "one of " + ", ".join(listed) + hint


def _short(value: object, limit: int = 120) -> str:
    """Returns `value` on one printable line, shortened to `limit` characters."""
    text = " ".join(str(value).split()) or "nothing"
    text = text if text.isprintable() else ascii(text)[1:-1]
    return text if len(text) <= limit else text[: limit - 1] + "…"
