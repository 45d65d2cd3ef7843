"""What docstrings say of the fields of settings, for whoever shows them to a user."""

import dataclasses
import functools
import inspect
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, get_type_hints

from fingers_deploy.decode import init_fields

_ENTRY = re.compile(r"(\w+(?:, \w+)*): (.*)")


@dataclass(frozen=True)
class Setting:
    """One field of settings that holds a value, not further settings.

    Attributes:
        name: dotted from the outermost settings.
        kind: its annotation.
        default: its value.
        doc: what the docstring of its class says of it.
        meta: unit and range.
    """

    name: str
    kind: Any
    default: Any
    doc: str
    meta: Mapping[str, Any]


def settings_of(config: Any, prefix: str = "") -> Iterator[Setting]:
    """Yields all fields of a configuration, those of nested ones too.

    Args:
        config: instance of a frozen dataclass.
        prefix: before each name, such as "env.".
    """
    kinds, docs = get_type_hints(type(config)), field_docs(type(config))
    for field in init_fields(config):
        name, value = prefix + field.name, getattr(config, field.name)
        if dataclasses.is_dataclass(value):
            yield from settings_of(value, f"{name}.")
            continue
        doc = docs.get(field.name, "")
        yield Setting(name, kinds[field.name], value, doc, field.metadata)


@functools.cache
def field_docs(cls: type) -> Mapping[str, str]:
    """What a dataclass and those it inherits from say of their fields.

    Args:
        cls: its docstring has a part "Attributes:", in which several fields may share
            an entry.
    """
    found: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        found |= _entries(inspect.cleandoc(base.__doc__ or ""))
    return found


def _entries(text: str) -> dict[str, str]:
    """Entries of the part "Attributes:", each on one line."""
    part = re.search(r"^Attributes:\n((?:    .*\n?|\n)+)", text, re.MULTILINE)
    if part is None:
        return {}
    body = inspect.cleandoc(part[1])
    joined = re.sub(r"\n+ +", " ", body).splitlines()
    entries = [match for line in joined if (match := _ENTRY.fullmatch(line))]
    return {name: m[2].strip() for m in entries for name in m[1].split(", ")}
