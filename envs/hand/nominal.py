"""Nominal parameters of a hand: kinematics, inertials, limits and drive.

Those of the WUJI right hand are the vendor's (WUJI right hand description, release
2026.04.27, MIT licence) with collision bounds measured on its meshes;
`vendor_hand.json` keeps them in metre, kilogram, radian and newton-metre. A hand file
may carry others.
"""

import json
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files

import numpy as np
from jaxtyping import Float

from envs.config.typed import from_dict, limits
from envs.errors import InputError

FINGERS = ("thumb", "index", "middle", "ring", "little")
"""The fingers of a hand of five; one with fewer has the first of them."""
MOST_FINGERS, MOST_LINKS = 5, 8

Vector = tuple[float, float, float]
Quat = tuple[float, float, float, float]
Capsule = tuple[Vector, Vector, float]


_PLACE, _TURN = limits("m", -0.5, 0.5), limits("1", -1.01, 1.01)
_MASS, _INERTIA = limits("kg", 1e-6, 5.0), limits("kg·m²", 1e-13, 1.0)


@dataclass(frozen=True)
class Link:
    """One finger link and the joint that carries it, in the parent link's frame.

    Attributes:
        body, joint: names.
        pos, quat: pose in the parent [m, w x y z]; the joint turns about +y.
        range_rad: joint limits.
        armature: reflected rotor inertia [kg·m²].
        mass, inertial_pos, inertial_quat, diaginertia: mass, centre of mass, principal
            axes and moments [kg, m, 1, kg·m²].
        kp, kv: nominal (uncalibrated) position-drive gains [N·m/rad, N·m·s/rad].
        force_limit: nominal drive torque limit [N·m].
        capsule: (from, to, radius) of the collision capsule, or None.
        tip: centre of the fingertip sphere [m] on distal links, else None; the end of
            the capsule.
    """

    body: str
    joint: str
    pos: Vector = field(metadata=_PLACE)
    quat: Quat = field(metadata=_TURN)
    range_rad: tuple[float, float] = field(metadata=limits("rad", -6.3, 6.3))
    armature: float = field(metadata=limits("kg·m²", 0.0, 1.0))
    mass: float = field(metadata=_MASS)
    inertial_pos: Vector = field(metadata=_PLACE)
    inertial_quat: Quat = field(metadata=_TURN)
    diaginertia: Vector = field(metadata=_INERTIA)
    kp: float = field(metadata=limits("N·m/rad", 1e-6, 1e4))
    kv: float = field(metadata=limits("N·m·s/rad", 0.0, 1e4))
    force_limit: float = field(metadata=limits("N·m", 1e-6, 1e3))
    capsule: Capsule | None = field(default=None, metadata=_PLACE)
    tip: Vector | None = field(default=None, metadata=_PLACE)

    def __post_init__(self) -> None:
        _check_unit("quat", self.quat)
        _check_inertia(self)
        low, high = self.range_rad
        if not low < high:
            raise InputError("hand", "range_rad", self.range_rad, "low below high")
        if self.capsule:
            start, end, radius = self.capsule
            if radius < 1e-4 or np.linalg.norm(np.subtract(end, start)) < 1e-4:
                valid = "two ends and a radius, 0.1 mm or more apart and thick"
                raise InputError("hand", "capsule", self.capsule, valid)


@dataclass(frozen=True)
class Palm:
    """The palm: inertial parameters and the bounds of its mesh [kg, m, kg·m²]."""

    mass: float = field(metadata=_MASS)
    inertial_pos: Vector = field(metadata=_PLACE)
    inertial_quat: Quat = field(metadata=_TURN)
    diaginertia: Vector = field(metadata=_INERTIA)
    bounds_min: Vector = field(metadata=_PLACE)
    bounds_max: Vector = field(metadata=_PLACE)

    def __post_init__(self) -> None:
        _check_inertia(self)
        if not np.all(np.subtract(self.bounds_max, self.bounds_min) > 1e-4):
            valid = f"each above that of bounds_min, {list(self.bounds_min)}"
            raise InputError("hand", "bounds_max", list(self.bounds_max), valid)


def _check_unit(name: str, quat: Quat) -> None:
    if abs(np.linalg.norm(quat) - 1.0) > 1e-3:
        valid = "w x y z of length 1"
        raise InputError("hand", name, list(quat), valid)


def _check_inertia(part: Link | Palm) -> None:
    """Refuses principal moments that no body has."""
    _check_unit("inertial_quat", part.inertial_quat)
    least, middle, most = sorted(part.diaginertia)
    # Of a plate they are equal, which rounding could break where the palm is scaled.
    if most > (least + middle) * (1.0 - 1e-12):
        valid = "moments of which each is less than the other two together"
        raise InputError("hand", "diaginertia", list(part.diaginertia), valid)


@dataclass(frozen=True)
class NominalHand:
    """The whole hand; `links` is finger-major, proximal to distal (n × m).

    It has 3 to 5 fingers, thumb first, of 2 to 8 links each. Only the last link of a
    finger has a tip; the first one may be without a capsule, inside the palm's reach.
    """

    palm: Palm
    links: tuple[Link, ...]

    def __post_init__(self) -> None:
        self._check_names()
        for index, link in enumerate(self.links):
            place = index % self.links_per_finger
            last = place == self.links_per_finger - 1
            bare = link.capsule is None and place > 0
            if bare or (link.tip is not None) != last:
                valid = (
                    "a capsule on each link after a finger's first, a tip on its last"
                )
                raise InputError("hand", f"links.{index}", link.body, valid)

    @property
    def links_per_finger(self) -> int:
        """Links of each finger, m."""
        return sum(link.body.startswith("finger1_") for link in self.links)

    @property
    def fingers(self) -> tuple[str, ...]:
        """Names of the fingers, n of `FINGERS`."""
        return FINGERS[: len(self.links) // self.links_per_finger]

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints in the order used everywhere."""
        return tuple(link.joint for link in self.links)

    @property
    def tip_links(self) -> tuple[Link, ...]:
        """The last link of each finger."""
        return tuple(link for link in self.links if link.tip)

    def _check_names(self) -> None:
        found = tuple((link.body, link.joint) for link in self.links)
        each = self.links_per_finger
        count = len(found) // max(each, 1)
        wanted = link_names(count, each)
        fits = 3 <= count <= MOST_FINGERS and 2 <= each <= MOST_LINKS
        if not fits or found != wanted:
            wrong = next((f for f, n in zip(found, wanted, strict=False) if f != n), "")
            names = " ".join(wrong) or f"{len(found)} links"
            valid = (
                "links finger1_link1, finger1_link2, … with such joints, in order: 3 "
                f"to {MOST_FINGERS} fingers of equally many links, 2 to {MOST_LINKS}"
            )
            raise InputError("hand", "links", names, valid)

    def per_joint(self, field: str) -> Float[np.ndarray, "joints ..."]:
        """A parameter of all links, x_j, j = 1 … n·m, as `per_joint("kp")` [N·m/rad].

        Args:
            field: of `Link`, which states its unit [rad, kg, kg·m², N·m, …].

        Source:
            WUJI right hand description 2026.04.27, or the hand file.
        """
        return np.array([getattr(link, field) for link in self.links])


def link_names(fingers: int, links: int) -> tuple[tuple[str, str], ...]:
    """Names of all links and their joints, finger by finger."""
    return tuple(
        (f"finger{f}_link{i}", f"finger{f}_joint{i}")
        for f in range(1, fingers + 1)
        for i in range(1, links + 1)
    )


def _link(raw: dict) -> Link:
    capsule = raw.get("collision", {}).get("capsule")
    same = ("body", "joint", "pos", "quat", "armature", "mass")
    inertial = ("inertial_pos", "inertial_quat", "diaginertia")
    data = {name: raw[name] for name in (*same, *inertial)} | raw["drive"]
    del data["ctrlrange"]
    data["range_rad"] = raw["range"]
    if capsule:
        ends = capsule["fromto"]
        data["capsule"] = [ends[:3], ends[3:], capsule["radius"]]
    if "fingertip" in raw:
        data["tip"] = raw["fingertip"]["pos"]
    return from_dict(Link, data, "vendor_hand.json", raw["body"])


def _palm(raw: dict) -> Palm:
    bounds = {f"bounds_{end}": raw["mesh_bounds"][end] for end in ("min", "max")}
    rest = {name: value for name, value in raw.items() if name != "mesh_bounds"}
    return from_dict(Palm, rest | bounds, "vendor_hand.json", "palm")


@cache
def _raw() -> dict:
    return json.loads(
        files("envs.hand").joinpath("vendor_hand.json").read_text("utf-8")
    )


@cache
def vendor_hand() -> NominalHand:
    """Reads the vendor's hand from `vendor_hand.json` beside this file."""
    return NominalHand(
        palm=_palm(_raw()["palm"]),
        links=tuple(_link(link) for f in _raw()["fingers"] for link in f["links"]),
    )
