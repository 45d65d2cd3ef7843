"""Where on the hand: joints by name, class or finger."""

from collections.abc import Iterable, Mapping

from envs.errors import InputError, one_of
from envs.hand.nominal import FINGERS, vendor_hand


def _places() -> dict[str, tuple[str, ...]]:
    """Joint 2 of a finger abducts; joints 3 and 4 are PIP and DIP."""
    names = vendor_hand().joint_names
    number = {n: names[n - 1 :: 4] for n in range(1, 5)}
    classes = {
        "all": names,
        "flexion": tuple(n for n in names if n not in number[2]),
        "abduction": number[2],
        "pip": number[3],
        "dip": number[4],
    }
    fingers = {f: names[4 * i : 4 * i + 4] for i, f in enumerate(FINGERS)}
    return classes | fingers | {name: (name,) for name in names}


PLACES: Mapping[str, tuple[str, ...]] = _places()
"""Joints by the name of a place: `all`, a class, a finger or a joint."""


def joints_at(where: Iterable[str]) -> tuple[int, ...]:
    """Returns the indices of the joints of all places named, in joint order.

    Raises:
        InputError: there is no such place.
    """
    found = set()
    for place in where:
        if place not in PLACES:
            raise InputError("hand file", "where", place, one_of(PLACES, place))
        found |= set(PLACES[place])
    return tuple(i for i, n in enumerate(vendor_hand().joint_names) if n in found)


def fingers_at(where: Iterable[str]) -> tuple[int, ...]:
    """Returns the indices of the fingers named.

    Raises:
        InputError: a place that is neither a finger nor `all`.
    """
    for place in where:
        if place not in ("all", *FINGERS):
            valid = one_of(("all", *FINGERS), place)
            raise InputError("hand file", "where", place, valid)
    return tuple(i for i, f in enumerate(FINGERS) if {"all", f} & set(where))
