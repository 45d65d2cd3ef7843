"""Completion in the shell: what a word on the command line may become."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from typing import Any

from envs.config.settings.backend import BACKENDS
from envs.errors import InputError
from envs.registry import task_names
from fingers_mjx.cli.arguments.flags import flag
from fingers_mjx.cli.arguments.parser import CommandParser
from fingers_mjx.ppo.config import PRESETS
from fingers_robot.cli.parser import UsageError

SCRIPTS = {
    "bash": """_fingers() {
  local IFS=$'\\n'
  COMPREPLY=($(fingers --complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null))
}
complete -o default -F _fingers fingers
""",
    "zsh": """#compdef fingers
_fingers() {
  local -a found
  found=(${(f)"$(fingers --complete "${(@)words[2,CURRENT]}" 2>/dev/null)"})
  (( $#found )) && compadd -a found || _files
}
compdef _fingers fingers
""",
}
"""Scripts that ask `fingers --complete`; without an answer, files are offered."""


def add(parser: argparse.ArgumentParser) -> None:
    """Adds `--print-completion`, and what its scripts call."""
    parser.add_argument(
        "--print-completion",
        choices=tuple(SCRIPTS),
        action=_Print,
        help='completion for a shell: eval "$(fingers --print-completion bash)"',
    )
    parser.add_argument(
        "--complete", nargs=argparse.REMAINDER, action=_Complete, help=argparse.SUPPRESS
    )


def candidates(parser: argparse.ArgumentParser, words: Sequence[str]) -> list[str]:
    """Returns what the last word may become.

    Args:
        parser: of all commands.
        words: after the program's name; the last may be empty or half a word.
    """
    *before, last = words or [""]
    found: Any = parser
    depth = 0
    for word in before:
        inner = _commands(found)
        if word not in inner:
            break
        found, depth = inner[word], depth + 1
    rest = before[depth:]
    return sorted(w for w in _words(found, rest, last) if w.startswith(last))


def _words(parser: Any, before: Sequence[str], last: str) -> Iterable[str]:
    """All words that fit behind others, whatever the last begins with."""
    named = {name: a for a in parser._actions for name in a.option_strings}
    if before and before[-1] in named and named[before[-1]].nargs != 0:
        return _values(named[before[-1]])
    if last.startswith("-"):
        return [*(n for n in named if n.startswith("--")), *_flags(parser, before)]
    if inner := _commands(parser):
        return inner
    places = [action for action in parser._actions if not action.option_strings]
    return [] if before or not places else _values(places[0])


def _commands(parser: Any) -> dict[str, Any]:
    """Commands of a parser by name; none of one that has arguments."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            return dict(action.choices)
    return {}


def _values(action: argparse.Action) -> Iterable[str]:
    """Names that an option or an argument takes; none where any text does."""
    names = {"task": task_names, "preset": lambda: PRESETS, "backend": lambda: BACKENDS}
    if action.dest in names:
        return names[action.dest]()
    return map(str, action.choices or ())


def _flags(parser: Any, before: Sequence[str]) -> list[str]:
    """Flags of the settings that a command would take behind other words."""
    if not isinstance(parser, CommandParser) or parser.offered is None:
        return []
    try:
        settings = parser.offered(parser.parse_known_args(list(before))[0])
    except (InputError, UsageError, OSError):
        return []
    return [flag(setting.name) for setting in settings]


class _Print(argparse.Action):
    def __call__(self, parser, namespace, values, option_string=None):
        print(SCRIPTS[str(values)], end="")
        parser.exit()


class _Complete(argparse.Action):
    def __call__(self, parser, namespace, values, option_string=None):
        for word in candidates(parser, list(values or [])):
            print(word)
        parser.exit()
