"""Where on the hand: joints by name, class or finger."""

from collections.abc import Iterable, Mapping

from envs.errors import InputError, one_of
from envs.hand.nominal import NominalHand


def places(hand: NominalHand) -> Mapping[str, tuple[str, ...]]:
    """Joints by the name of a place: `all`, a class, a finger or a joint.

    Joint 2 of a finger abducts; the last two are PIP and DIP.
    """
    names, each = hand.joint_names, hand.links_per_finger
    number = {n: names[n - 1 :: each] for n in range(1, each + 1)}
    classes = {
        "all": names,
        "flexion": tuple(n for n in names if n not in number[2]),
        "abduction": number[2],
        "pip": number[each - 1],
        "dip": number[each],
    }
    fingers = {f: names[each * i : each * (i + 1)] for i, f in enumerate(hand.fingers)}
    return classes | fingers | {name: (name,) for name in names}


def joints_at(hand: NominalHand, where: Iterable[str]) -> tuple[int, ...]:
    """Returns the indices of the joints of all places named, in joint order.

    Raises:
        InputError: there is no such place.
    """
    found, known = set(), places(hand)
    for place in where:
        if place not in known:
            raise InputError("hand file", "where", place, one_of(known, place))
        found |= set(known[place])
    return tuple(i for i, n in enumerate(hand.joint_names) if n in found)


def fingers_at(hand: NominalHand, where: Iterable[str]) -> tuple[int, ...]:
    """Returns the indices of the fingers named.

    Raises:
        InputError: a place that is neither a finger nor `all`.
    """
    for place in where:
        if place not in ("all", *hand.fingers):
            valid = one_of(("all", *hand.fingers), place)
            raise InputError("hand file", "where", place, valid)
    return tuple(i for i, f in enumerate(hand.fingers) if {"all", f} & set(where))
