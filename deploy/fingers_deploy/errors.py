"""Errors that a user can cause: input that is refused in one sentence."""

import difflib
from collections.abc import Iterable

_SOURCE, _FIELD, _FOUND, _SENTENCE = 100, 60, 80, 300


class InputError(ValueError):
    """Bad input: one sentence names the place, what was found and what is valid.

    It has at most 300 characters, 80 of them for what was found.

    Args:
        source: file, command-line option or argument in which the value stands.
        field: the field inside `source`, dotted; empty when the source as a whole is
            at fault.
        found: what was found there.
        valid: what would have been valid.
    """

    def __init__(self, source: object, field: str, found: object, valid: str):
        self.source, self.field, self.found, self.valid = source, field, found, valid
        where = shortened(source, _SOURCE)
        where += f": {shortened(field, _FIELD)}" if field else ""
        sentence = f"{where}: found {shortened(found)}; valid: "
        super().__init__(sentence + shortened(valid, _SENTENCE - len(sentence)))


class BundleError(InputError):
    """A policy bundle that cannot be honoured."""


def one_of(names: Iterable[str], found: str = "") -> str:
    """Lists valid names, and the one that `found` was probably meant to be."""
    listed = list(names)
    near = difflib.get_close_matches(found[:_FOUND], listed, n=1)
    hint = f" (did you mean {near[0]}?)" if near else ""
    return "one of " + ", ".join(listed) + hint


def shortened(value: object, limit: int = _FOUND) -> str:
    """Returns a value as one printable line of at most `limit` characters.

    What is left out is in the middle: two paths often differ in their ends.
    """
    try:
        text = str(value)
    except (RecursionError, UnicodeError):
        text = f"a {type(value).__name__} that cannot be shown"
    half = limit // 2
    if len(text) > 4 * limit:  # before anything is done with each character
        text = f"{text[: 2 * limit]}…{text[-2 * limit :]}"
    text = " ".join(text.split()) or "nothing"
    text = text if text.isprintable() else ascii(text)[1:-1]
    if len(text) <= limit:
        return text
    return f"{text[: limit - half]}…{text[len(text) - half + 1 :]}"
