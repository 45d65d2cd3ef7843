"""A user's MJCF carried over into a hand file, so that every backend runs it.

Kinematics, inertia, limits and drive are the model's numbers in our frames; collision
shapes are capsules and a box fitted to its colliding geoms. What the model lacks is
taken from the vendor's hand and noted. In the end both models must put the
fingertips at the same places and weigh the same.
"""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from envs.errors import InputError
from envs.hand.hand_file import HandFile, load_hand_file
from envs.hand.importing.check import check_same
from envs.hand.importing.drive import ImportedDrive, drive_of, own_drive_of
from envs.hand.importing.inertia import (
    PALM_GROUP,
    PAYLOAD_GROUP,
    Inertia,
    inertia_of,
)
from envs.hand.importing.joint_map import JointMap
from envs.hand.importing.load import load_custom_hand
from envs.hand.importing.palm import Frame
from envs.hand.importing.place import Placed, place
from envs.hand.importing.shape import (
    bounds,
    colliding_geoms,
    link_capsule,
    rounded,
    surface_points,
)
from envs.hand.nominal import Capsule, Link, NominalHand, Palm, vendor_hand
from envs.hand.quantity import JointQuantity, Quantity, Vector

COMPILE_CPU_S = 60
_SCALES = {
    "kp": "stiffness_scale",
    "kv": "damping_scale",
    "force_limit": "torque_scale",
}
_NO_PAYLOAD_M = 0.001
LONG_M = 0.030
"""Length from which a finger's first link counts as one that may touch something."""


@dataclass(frozen=True)
class ImportedHand:
    """A user's hand as a hand file.

    Attributes:
        hand: the hand file, with nominal parameters of its own.
        notes: sentences that say what the model lacked and what took its place.
    """

    hand: HandFile
    notes: tuple[str, ...]


def import_hand(
    path: str | Path,
    joint_map: JointMap | None = None,
) -> ImportedHand:
    """Makes a hand file of a user's MJCF.

    Args:
        path: main MJCF file; everything it names must lie in its folder.
        joint_map: the model's names of our joints where they differ, or its fingers.

    Returns:
        The hand file: the default one in what an MJCF does not hold (delay, filter,
        speed, friction).

    Raises:
        InputError: as `load_custom_hand`; or a map without fingers, and the model is
            another hand than five fingers of four links on a palm, arranged as the WUJI
            right hand's; or one with them, and the model lacks shapes or gains.
    """
    given = joint_map or JointMap()
    own = bool(given.fingers)
    custom = load_custom_hand(path, given, COMPILE_CPU_S)
    placed = place(custom, given.palm_quat, not own)
    actuators = [placed.model.actuator(name).id for name in custom.actuators]
    where = (placed.model, placed.joints, actuators)
    drive = own_drive_of(custom.path, *where, given.drive) if own else drive_of(*where)
    shapes, shape_notes = _own_capsules(placed) if own else _capsules(placed)
    palm, palm_notes = _palm(placed, own)
    links = tuple(
        _link(placed, index, drive, shapes[index]) for index in range(len(shapes))
    )
    speed = given.drive.speed_limit
    nominal = NominalHand(palm, links)
    hand, hand_notes = _hand_file(placed, nominal, drive, _speeds(own, speed))
    check_same(placed, hand)
    notes = (*custom.defaults, *drive.notes, *shape_notes, *palm_notes, *hand_notes)
    if placed.model.neq or placed.model.ntendon:
        notes += ("equality constraints and tendons are left out",)
    return ImportedHand(hand, notes)


def _capsules(placed: Placed) -> tuple[list[Capsule | None], tuple[str, ...]]:
    """Capsules of links 2 to 4 of each finger; the vendor's where no geom collides."""
    found: list[Capsule | None] = []
    lacking = []
    for index, vendor in enumerate(vendor_hand().links):
        geoms = colliding_geoms(placed.model, placed.bodies[index])
        if vendor.capsule is None:
            found.append(None)
        elif geoms:
            frame = placed.link_w(index)
            found.append(link_capsule(placed.model, placed.data, geoms, frame))
        else:
            found.append(vendor.capsule)
            body = placed.bodies[index][0]
            lacking.append(placed.model.body(body).name)
    note = f"no colliding geom on {', '.join(lacking)}: the vendor's capsules"
    return found, (note,) * bool(lacking)


def _own_capsules(placed: Placed) -> tuple[list[Capsule | None], tuple[str, ...]]:
    """Capsules of all links but those whose finger goes on where they begin."""
    found: list[Capsule | None] = []
    for index, frame in enumerate(placed.links):
        first = index % placed.each == 0
        geoms = colliding_geoms(placed.model, placed.bodies[index])
        if first and np.linalg.norm(placed.links[index + 1].pos - frame.pos) < LONG_M:
            found.append(None)
        elif geoms:
            at = placed.link_w(index)
            found.append(link_capsule(placed.model, placed.data, geoms, at))
        else:
            body = placed.model.body(placed.bodies[index][0]).name
            valid = "a colliding geom on every link after a finger's first"
            raise InputError(placed.custom.path, "", f"none on {body}", valid)
    return found, ()


def _palm(placed: Placed, own: bool) -> tuple[Palm, tuple[str, ...]]:
    bodies = placed.bodies[PALM_GROUP]
    inertia = _inertia(placed, bodies, placed.palm_w, "palm")
    geoms = colliding_geoms(placed.model, bodies)
    low, high = vendor_hand().palm.bounds_min, vendor_hand().palm.bounds_max
    if own and not geoms:
        raise InputError(placed.custom.path, "", "none", "a colliding geom on the palm")
    if geoms:
        points = surface_points(placed.model, placed.data, geoms, placed.palm_w)
        low, high = bounds(points)
    palm = Palm(
        **_inertial(inertia), bounds_min=_rounded(low), bounds_max=_rounded(high)
    )
    return palm, ("no colliding geom on the palm: the vendor's bounds",) * (not geoms)


def _link(
    placed: Placed, index: int, drive: ImportedDrive, capsule: Capsule | None
) -> Link:
    body, joint = placed.custom.names[index]
    frame = placed.links[index]
    if index % placed.each:
        frame = placed.links[index - 1].inverse.of(frame)
    inertia = _inertia(placed, placed.bodies[index], placed.link_w(index), body)
    drives: dict[str, Any] = {
        name: rounded(values[index]) for name, values in drive.values.items()
    }
    return Link(
        body=body,
        joint=joint,
        pos=_rounded(frame.pos),
        quat=_rounded(frame.quat),
        range_rad=_rounded(placed.model.jnt_range[placed.joints[index]]),
        capsule=capsule,
        tip=capsule[1] if capsule and (index + 1) % placed.each == 0 else None,
        **_inertial(inertia),
        **drives,
    )


def _inertia(placed: Placed, bodies: list[int], frame: Frame, name: str) -> Inertia:
    found = inertia_of(placed.model, placed.data, bodies, frame)
    if not (found.mass > 0 and found.diagonal.min() > 0):
        weak = f"{name} with mass {found.mass:g} kg, inertia {found.diagonal}"
        raise InputError(placed.custom.path, "", weak, "mass and inertia above 0")
    return found


def _inertial(inertia: Inertia) -> dict[str, Any]:
    return {
        "mass": rounded(inertia.mass),
        "inertial_pos": _rounded(inertia.pos),
        "inertial_quat": _rounded(inertia.quat),
        "diaginertia": _rounded(inertia.diagonal),
    }


def _hand_file(
    placed: Placed,
    own: NominalHand,
    drive: ImportedDrive,
    speeds: dict[str, JointQuantity],
) -> tuple[HandFile, tuple[str, ...]]:
    """The default hand file with what the model holds in the place of its own."""
    default, note = load_hand_file(), f"of {placed.custom.path.name}"
    scales = {
        _SCALES[name]: JointQuantity(
            1.0,
            "1",
            "user",
            note=f"{name} is that {'of the map' if name in drive.mapped else note}",
        )
        for name in drive.own & set(_SCALES)
    }
    kept = [field for name, field in _SCALES.items() if name not in drive.own]
    payload, notes = _payload(placed, own, note)
    if kept:
        notes += (f"{', '.join(kept)}: the default hand's, on the vendor's parameters",)
    hand = dataclasses.replace(
        default,
        name=f"hand {note}",
        palm_mass=Quantity(own.palm.mass, "kg", "user", note=note),
        palm_com_offset=Vector((0.0, 0.0, 0.0), "m", "user", note=note),
        description=own,
        **payload,
        **scales,
        **speeds,
    )
    return hand, notes


def _speeds(own: bool, given: float | None) -> dict[str, JointQuantity]:
    """The speed limit of a hand with joints of its own; else the default hand's."""
    if not own:
        return {}
    if given is not None:
        return {"speed_limit": JointQuantity(given, "rad/s", "user", note="of the map")}
    lowest = float(load_hand_file().per_joint("speed_limit").min())
    note = "the lowest of the default hand"
    return {"speed_limit": JointQuantity(lowest, "rad/s", "ours", note=note)}


def _payload(
    placed: Placed, own: NominalHand, note: str
) -> tuple[dict, tuple[str, ...]]:
    """The module on the back: mass, centre and box; a speck inside without one."""
    bodies, notes = placed.bodies[PAYLOAD_GROUP], ()
    mass, pos = 0.0, np.array(own.palm.inertial_pos)
    size = np.full(3, _NO_PAYLOAD_M)
    if bodies:
        inertia = inertia_of(placed.model, placed.data, bodies, placed.palm_w)
        mass, pos = inertia.mass, inertia.pos
        if geoms := colliding_geoms(placed.model, bodies):
            points = surface_points(placed.model, placed.data, geoms, placed.palm_w)
            size = np.ptp(points, axis=0)
    else:
        notes = ("no body named payload: nothing is carried on the back",)
    return {
        "payload_mass": Quantity(rounded(mass), "kg", "user", note=note),
        "payload_pos": Vector(_rounded(pos), "m", "user", note=note),
        "payload_size": Vector(_rounded(size), "m", "user", note=note),
    }, notes


def _rounded(values: Float[np.ndarray, " n"] | tuple[float, ...]) -> tuple:
    return tuple(rounded(value) for value in values)
