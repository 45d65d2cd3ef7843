"""Words on the command line: a mistake is one sentence, and nothing is guessed."""

import argparse
import re
from collections.abc import Iterator
from typing import Any, NoReturn

from fingers_deploy.errors import InputError, one_of, shortened

_LONGEST = 200  # of a sentence, without how to get help
_DIGITS = 40
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?inf|nan", re.ASCII)
_WHOLE = re.compile(r"[-+]?(\d+|0[xX][0-9a-fA-F]+)", re.ASCII)


class UsageError(Exception):
    """Words on the command line that do not fit, in one sentence."""


class Parser(argparse.ArgumentParser):
    """Puts a mistake into one sentence and leaves the exit to `main`.

    Args:
        options: as `argparse.ArgumentParser`; half a name is none.
    """

    def __init__(self, **options: Any):
        super().__init__(**{"allow_abbrev": False, **options})

    def error(self, message: str) -> NoReturn:
        """Raises the mistake."""
        raise UsageError(f"{shortened(message, _LONGEST)} (see {self.prog} --help)")

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Raises if a command or an option has choices and this is none of them."""
        if action.choices is None or value in action.choices:
            return
        name = "/".join(action.option_strings) or str(action.metavar or action.dest)
        valid = one_of(map(str, action.choices), str(value))
        self.error(str(InputError(name, "", value, valid)))


def plain_whole(text: str) -> int | None:
    """A whole number of plain digits; None for anything else, such as `1_0` or `١`."""
    if not _WHOLE.fullmatch(text) or len(text) > _DIGITS:
        return None
    return int(text, 0) if "x" in text.lower() else int(text)


def plain_number(text: str) -> float | None:
    """A number of plain digits; None for anything else, as `plain_whole`."""
    return float(text) if _NUMBER.fullmatch(text) and len(text) <= _DIGITS else None


def whole(text: str) -> int:
    """A whole number, for an argument of the command line."""
    if (value := plain_whole(text)) is None:
        raise argparse.ArgumentTypeError(f"{shortened(text)!r} is no whole number")
    return value


def number(text: str) -> float:
    """A number, for an argument of the command line."""
    if (value := plain_number(text)) is None:
        raise argparse.ArgumentTypeError(f"{shortened(text)!r} is no number")
    return value


def refuse_empty(options: argparse.Namespace) -> None:
    """Refuses options that were given an empty text, which must not count as none.

    Raises:
        UsageError: naming the option.
    """
    for name, value in _texts(vars(options)):
        if not value.strip():
            raise UsageError(f"{name}: found an empty text; valid: a text, or nothing")


def _texts(options: dict[str, Any]) -> Iterator[tuple[str, str]]:
    for name, value in options.items():
        for entry in value if isinstance(value, list | tuple) else (value,):
            if isinstance(entry, str):
                yield f"--{name.replace('_', '-')}", entry
