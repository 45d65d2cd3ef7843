"""The parser of `fingers`: words of a command, and settings as flags."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

from fingers_deploy.errors import InputError
from fingers_robot.cli.parser import Parser, UsageError

if TYPE_CHECKING:
    from envs.config.documented import Setting

HELP = ("-h", "--help")
ASSIGNED = ("--set", "arguments")
"""Sources that errors of settings name, whether those came from flags or not."""


class CommandParser(Parser):
    """Takes flags of settings where a command offers some.

    Attributes:
        offered: returns, for the other arguments, the settings that may be given.
    """

    offered: Callable[[argparse.Namespace], Iterable[Setting]] | None = None

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parses the words; flags of settings become assignments as of `--set`.

        Raises:
            UsageError: words that do not fit.
            InputError: a setting that does not exist, or a wrong number of values.
        """
        if self.offered is None or args is None:
            return super().parse_known_args(args, namespace)
        from fingers_mjx.cli.arguments.flags import assignments, divided

        own = [name for action in self._actions for name in action.option_strings]
        words, flags = divided(args, own)
        if set(HELP) & set(words):
            self._explain([word for word in words if word not in HELP], self.offered)
        found, rest = super().parse_known_args(words, namespace)
        if flags:
            others = [name for name in own if name.startswith("--")]
            given = assignments(self.offered(found), flags, others)
            found.settings = [*found.settings, *given]
            found.flags = [w.partition("=")[0] for w in flags if w.startswith("--")]
        return found, rest

    def _explain(
        self,
        words: Sequence[str],
        offered: Callable[[argparse.Namespace], Iterable[Setting]],
    ) -> None:
        """Prints the help of the command, and that of the settings it would take."""
        from fingers_mjx.cli.arguments.flags import show

        try:
            found = super().parse_known_args(words)[0]
        except UsageError:  # an argument is missing: the help says which
            found = None
        settings = [] if found is None else list(offered(found))
        self.print_help()
        if settings:
            print(flush=True)
            show(settings, " ".join((self.prog, *words)))
        self.exit()


def as_typed(error: InputError, flags: Iterable[str]) -> InputError:
    """Returns an error of a setting under the flag that gave it, if one did.

    Args:
        error: of a setting, such as `num_envs` of `--set`.
        flags: as they were typed, such as `--num-envs`.
    """
    if str(error.source) not in ASSIGNED:
        return error
    for flag in flags:
        name = flag.removeprefix("--").replace("-", "_")
        if error.field == name or error.field.startswith(f"{name}."):
            rest = error.field[len(name) + 1 :]
            return InputError(flag, rest, error.found, error.valid)
    return error
