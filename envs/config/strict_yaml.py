"""Strict YAML: what a configuration may say, and the same written back.

No duplicate keys, anchors, aliases, tags, deep nesting or large files, and the scalars
of YAML 1.2 (`1e-3` is a number, `on` is text).
"""

import re
from typing import Any

import yaml

from envs.errors import InputError

MAX_YAML_BYTES = 1 << 18
MAX_YAML_NODES = 20_000
MAX_YAML_DEPTH = 32

_RESOLVERS = (  # YAML 1.2 core schema: name, pattern, possible first characters
    ("null", r"~|null|", ["~", "n", ""]),
    ("bool", r"true|false", ["t", "f"]),
    ("int", r"[-+]?[0-9]+", list("-+0123456789")),
    (
        "float",
        r"[-+]?(\.[0-9]+|[0-9]+\.[0-9]*|[0-9]+(?=[eE]))([eE][-+]?[0-9]+)?"
        r"|[-+]?\.inf|\.nan",
        list("-+.0123456789"),
    ),
)


def parse_yaml(text: str, source: object) -> Any:
    """Returns the plain data in YAML text.

    Raises:
        InputError: not strict YAML, which names line and column, or too much of it:
            reading YAML takes a second for some ten thousand values.
    """
    if len(text) > MAX_YAML_BYTES:
        raise InputError(source, "", f"{len(text)} characters", _MOST)
    try:
        _refuse_features(text)
        return _Loader(text).get_single_data()
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f" at line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        problem = f"{getattr(error, 'problem', None) or error}{where}"
        raise InputError(source, "", problem, "strict YAML") from error


_MOST = f"at most {MAX_YAML_BYTES >> 10} KiB of YAML with {MAX_YAML_NODES} values"
_NO_TEXT = re.compile(r"[\ud800-\udfff\x00-\x08\x0b-\x1f\x7f]")
"""Characters that no file can hold as UTF-8 or that no name has."""


def write_yaml(data: Any) -> str:
    """Returns YAML text of plain data that `parse_yaml` reads back to the same."""
    style = {"default_flow_style": None, "allow_unicode": True, "width": 88}
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, **style)


class _Loader(yaml.SafeLoader):
    """Safe loader with the core schema and without duplicate keys."""

    yaml_implicit_resolvers: dict[str, Any] = {}


class _Dumper(yaml.SafeDumper):
    """Safe dumper that quotes exactly the text `_Loader` would not read as text."""

    yaml_implicit_resolvers: dict[str, Any] = {}

    def ignore_aliases(self, data: Any) -> bool:
        return True  # equal objects are written twice


def _construct_mapping(loader: _Loader, node: yaml.MappingNode) -> dict[str, Any]:
    mapping: dict[str, Any] = {}
    for key_node, value_node in node.value:
        key = loader.construct_object(key_node, deep=True)
        if not isinstance(key, str) or key in mapping:
            fault = "twice" if isinstance(key, str) else "which is not text"
            raise _yaml_error(f"the key {key!r} {fault}", key_node)
        mapping[key] = loader.construct_object(value_node, deep=True)
    return mapping


def _construct_int(loader: _Loader, node: yaml.ScalarNode) -> int:
    if len(node.value) > 100:
        raise _yaml_error("a number of more than 100 digits", node)
    return int(node.value)


for _name, _pattern, _first in _RESOLVERS:
    for _class in (_Loader, _Dumper):
        _regexp = re.compile(f"^(?:{_pattern})$")
        _class.add_implicit_resolver(f"tag:yaml.org,2002:{_name}", _regexp, _first)
_Loader.add_constructor("tag:yaml.org,2002:map", _construct_mapping)
_Loader.add_constructor("tag:yaml.org,2002:int", _construct_int)


def _refuse_features(text: str) -> None:
    """Refuses anchors, aliases, tags and deep nesting before anything is built."""
    depth = nodes = 0
    for event in yaml.parse(text, Loader=_Loader):
        nodes += isinstance(event, yaml.NodeEvent)
        if nodes > MAX_YAML_NODES:
            raise _yaml_error(f"more than {MAX_YAML_NODES} values", event)
        if _NO_TEXT.search(getattr(event, "value", "")):
            raise _yaml_error("a character that is no text", event)
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_YAML_DEPTH:
            raise _yaml_error(f"nesting deeper than {MAX_YAML_DEPTH}", event)
        if getattr(event, "anchor", None):  # aliases have one too
            raise _yaml_error("an anchor or alias", event)
        if getattr(event, "tag", None) is not None:
            raise _yaml_error("a tag", event)


def _yaml_error(problem: str, at: Any) -> yaml.YAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=at.start_mark)
