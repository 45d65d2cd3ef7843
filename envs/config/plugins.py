"""What other installed packages bring: known by entry points, imported when used."""

import functools
from collections.abc import Mapping
from importlib.metadata import EntryPoint, entry_points
from typing import TypeVar

from envs.errors import InputError, one_of

T = TypeVar("T")


@functools.cache
def found(group: str) -> Mapping[str, tuple[EntryPoint, ...]]:
    """Entry points of `group` by name, several where several packages bring one."""
    named: dict[str, dict[tuple[str, str], EntryPoint]] = {}
    for point in entry_points(group=group):  # a package may be on the path twice
        named.setdefault(point.name, {})[origin(point), point.value] = point
    return {name: tuple(same.values()) for name, same in sorted(named.items())}


def load(group: str, name: str, kind: type[T]) -> T:
    """Imports what a package brings under a name of a group, an instance of `kind`.

    Raises:
        InputError: nobody or several bring it, it cannot be imported, or it is of
            another kind; the sentence names the package.
    """
    points, place = found(group).get(name, ()), f"entry point {name} ({group})"
    if len(points) != 1:
        both = " and ".join(map(origin, points))
        valid = "one package that brings it" if both else one_of(found(group), name)
        raise InputError(place, "", both or name, valid)
    try:
        value = points[0].load()
    except (Exception, SystemExit) as error:
        what, valid = f"{type(error).__name__}: {error}", "one that can be imported"
        raise InputError(f"package {origin(points[0])}", place, what, valid) from error
    if not isinstance(value, kind):
        what, valid = type(value).__name__, f"a {kind.__name__}"
        raise InputError(f"package {origin(points[0])}", place, what, valid)
    return value


def origin(point: EntryPoint) -> str:
    """Name and version of the package that an entry point is of."""
    return f"{point.dist.name} {point.dist.version}" if point.dist else "unknown"
