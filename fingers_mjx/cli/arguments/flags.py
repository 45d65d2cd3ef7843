"""Settings as arguments, such as `--env.episode-s 10`: tyro reads and lists them.

Each becomes an assignment as of `--set`, so that there is one place in which values are
checked and one form in which runs and evaluations record them. tyro sees settings
alone: its messages fill a box of several lines and end the process, where ours are one
sentence with the nearest name.
"""

from __future__ import annotations

import dataclasses
import json
import types
import typing
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from envs.config.documented import Setting
from envs.errors import InputError, one_of
from fingers_deploy.decode import describe
from fingers_robot.cli.parser import plain_number

Tree = dict[str, "Setting | Tree"]


@dataclass(frozen=True)
class Words:
    """What stands after a flag; the default where the flag was not given."""

    given: tuple[str, ...] | None
    default: tuple[str, ...] = ()


def assignments(
    settings: Iterable[Setting], words: Sequence[str], others: Iterable[str] = ()
) -> list[str]:
    """Returns flags as assignments, such as "env.episode_s=10".

    Args:
        settings: those that may be given.
        words: of the command line: flags, each with its values after it.
        others: options that are none of settings, which may have been meant.

    Raises:
        InputError: there is no such setting, or its number of values is wrong.
    """
    import tyro

    known = {setting.name: setting for setting in settings}
    made, unknown = tyro.cli(
        _tree_class(_nested(known)),
        args=list(words),
        return_unknown_args=True,
        console_outputs=False,
        add_help=False,
    )
    for word in unknown:
        valid = one_of([*others, *map(flag, known)], word.partition("=")[0])
        raise InputError("arguments", "", word, valid)
    given = ((name, words) for name, words in _leaves(made) if words.given is not None)
    return [text for name, words in given for text in _assigned(known[name], words)]


def show(settings: Iterable[Setting], program: str) -> None:
    """Prints all flags with type, unit, default and description.

    Args:
        settings: those that may be given.
        program: what is typed before them.
    """
    import tyro

    known = {setting.name: setting for setting in settings}
    try:
        tyro.cli(_tree_class(_nested(known)), args=["--help"], prog=program)
    except SystemExit:
        return


def flag(name: str) -> str:
    """Returns the flag of a setting."""
    return "--" + name.replace("_", "-")


def divided(words: Iterable[str], own: Collection[str]) -> tuple[list[str], list[str]]:
    """Divides words into those of the command and flags with their values.

    What follows the first value of a flag belongs to it while it is a number or has a
    "=": so a flag may stand before an argument of the command.

    Args:
        words: of the command line, after the command.
        own: options of the command itself.
    """
    rest: list[str] = []
    flags: list[str] = []
    open_for = 0  # values that the flag may still take; 1 means its first
    for word in words:
        name, equals, _ = word.partition("=")
        if name.startswith("--") and len(name) > 2 and name not in own:
            flags.append(word)
            open_for = 0 if equals else 1
        elif open_for and (open_for == 1 or _goes_on(word)) and not _is_option(word):
            flags.append(word)
            open_for += 1
        else:
            rest.append(word)
            open_for = 0
    return rest, flags


def _goes_on(word: str) -> bool:
    return "=" in word or plain_number(word) is not None


def _is_option(word: str) -> bool:
    return word.startswith("-") and plain_number(word) is None


def _leaves(made: Any, prefix: str = "") -> Iterator[tuple[str, Words]]:
    """Yields what tyro has made, by dotted name."""
    for field in dataclasses.fields(made):
        value = getattr(made, field.name)
        if isinstance(value, Words):
            yield prefix + field.name, value
        else:
            yield from _leaves(value, f"{prefix}{field.name}.")


def _assigned(setting: Setting, words: Words) -> Iterator[str]:
    """Yields the assignments of one flag."""
    given, kind = words.given or (), _plain(setting.kind)
    if typing.get_origin(kind) is dict:
        yield from (f"{setting.name}.{word}" for word in given)
    elif typing.get_origin(kind) is tuple:
        yield f"{setting.name}=[{', '.join(given)}]"
    elif len(given) != 1:
        valid = describe(setting.kind, setting.meta)
        raise InputError(flag(setting.name), "", " ".join(given), valid)
    else:
        yield f"{setting.name}={given[0]}"


def _plain(kind: Any) -> Any:
    """Returns a kind without the None that it may also be."""
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        kinds = [k for k in typing.get_args(kind) if k is not types.NoneType]
        return kinds[0] if len(kinds) == 1 else str
    return kind


def _nested(settings: Mapping[str, Setting]) -> Tree:
    """Returns settings by the parts of their names."""
    tree: Tree = {}
    for name, setting in settings.items():
        *path, last = name.split(".")
        place: Any = tree
        for part in path:
            place = place.setdefault(part, {})
        place[last] = setting
    return tree


def _tree_class(tree: Tree, name: str = "Settings") -> Any:
    """Returns a dataclass in which tyro finds a flag for each setting."""
    fields = []
    for key, value in tree.items():
        if isinstance(value, dict):
            kind = _tree_class(value, key.capitalize())
            fields.append((key, kind, dataclasses.field(default_factory=kind)))
        else:
            default = Words(None, _shown(value.default))
            fields.append((key, _kind(value), dataclasses.field(default=default)))
    made = dataclasses.make_dataclass(name, fields, frozen=True)
    made.__doc__ = None
    return made


def _kind(setting: Setting) -> Any:
    """Returns the annotation by which tyro reads and describes a setting."""
    import tyro

    spec = tyro.constructors.PrimitiveConstructorSpec(
        nargs="*",
        metavar=_metavar(setting),
        instance_from_str=lambda words: Words(tuple(words)),
        is_instance=lambda value: isinstance(value, Words),
        str_from_instance=lambda words: list(words.default),
    )
    return Annotated[Words, spec, tyro.conf.arg(help=_help(setting))]


def _help(setting: Setting) -> str:
    """Returns description, type, range and unit."""
    return f"{setting.doc} Valid: {describe(setting.kind, setting.meta)}."


def _metavar(setting: Setting) -> str:
    """Returns what stands for the value: its kind, and as often as it is there."""
    kind = _plain(setting.kind)
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if origin is dict:
        return "NAME=VALUE..."
    if origin is tuple:
        return (
            f"{_word(args[0])}..."
            if args[-1] is Ellipsis
            else " ".join(map(_word, args))
        )
    return _word(kind)


def _word(kind: Any) -> str:
    if typing.get_origin(kind) is typing.Literal:
        return "{" + ",".join(map(str, typing.get_args(kind))) + "}"
    words = {int: "INT", float: "FLOAT", bool: "{true,false}", str: "TEXT"}
    return words.get(kind, "YAML")


def _shown(value: Any) -> tuple[str, ...]:
    """Returns a default as the words that would be typed; `none` for an empty one."""
    if isinstance(value, Mapping):
        words = [f"{name}={_typed(entry)}" for name, entry in value.items()]
    elif isinstance(value, tuple | list):
        words = [_typed(entry) for entry in value]
    else:
        words = [_typed(value)] if value not in (None, "") else []
    return tuple(words) or ("none",)


def _typed(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)
