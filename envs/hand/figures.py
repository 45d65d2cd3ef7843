"""Figures of the WUJI right hand: kinematics, inertials, limits and nominal drive.

The numbers are the vendor's (WUJI right hand description, release 2026.04.27, MIT
licence) with collision bounds measured on its meshes; `figures.json` keeps them in
metre, kilogram, radian and newton-metre.
"""

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

FINGERS = ("thumb", "index", "middle", "ring", "little")


@dataclass(frozen=True)
class Link:
    """One finger link and the joint that carries it, in the parent link's frame.

    Attributes:
        body, joint: names.
        pos, quat: pose in the parent [m, w x y z]; the joint turns about +y.
        range_rad: joint limits.
        armature: reflected rotor inertia [kg·m²].
        mass, inertial_pos, inertial_quat, diaginertia: inertial figures [kg, m, kg·m²].
        kp, kv: nominal (uncalibrated) position-drive gains [N·m/rad, N·m·s/rad].
        force_limit: nominal drive torque limit [N·m].
        capsule: (from, to, radius) of the collision capsule, or None.
        tip: centre of the fingertip sphere [m] on distal links, else None.
    """

    body: str
    joint: str
    pos: tuple[float, ...]
    quat: tuple[float, ...]
    range_rad: tuple[float, float]
    armature: float
    mass: float
    inertial_pos: tuple[float, ...]
    inertial_quat: tuple[float, ...]
    diaginertia: tuple[float, ...]
    kp: float
    kv: float
    force_limit: float
    capsule: tuple[tuple[float, ...], tuple[float, ...], float] | None
    tip: tuple[float, ...] | None


@dataclass(frozen=True)
class Palm:
    """The palm: inertial figures and the bounds of its mesh [kg, m, kg·m²]."""

    mass: float
    inertial_pos: tuple[float, ...]
    inertial_quat: tuple[float, ...]
    diaginertia: tuple[float, ...]
    bounds_min: tuple[float, ...]
    bounds_max: tuple[float, ...]


@dataclass(frozen=True)
class Figures:
    """The whole hand; `links` is finger-major, proximal to distal (5 × 4)."""

    palm: Palm
    links: tuple[Link, ...]
    kinematics_checks: tuple[tuple[np.ndarray, np.ndarray], ...]

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the 20 joints in the order used everywhere."""
        return tuple(link.joint for link in self.links)

    def per_joint(self, field: str) -> np.ndarray:
        """One figure of all 20 links as an array, e.g. `per_joint("kp")`."""
        return np.array([getattr(link, field) for link in self.links])


def _link(raw: dict) -> Link:
    capsule = raw.get("collision", {}).get("capsule")
    ends = capsule and tuple(map(float, capsule["fromto"]))
    return Link(
        body=raw["body"],
        joint=raw["joint"],
        armature=raw["armature"],
        mass=raw["mass"],
        pos=tuple(raw["pos"]),
        quat=tuple(raw["quat"]),
        inertial_pos=tuple(raw["inertial_pos"]),
        inertial_quat=tuple(raw["inertial_quat"]),
        diaginertia=tuple(raw["diaginertia"]),
        range_rad=tuple(raw["range"]),
        kp=raw["drive"]["kp"],
        kv=raw["drive"]["kv"],
        force_limit=raw["drive"]["force_limit"],
        capsule=(ends[:3], ends[3:], capsule["radius"]) if capsule else None,
        tip=tuple(raw["fingertip"]["pos"]) if "fingertip" in raw else None,
    )


def _palm(raw: dict) -> Palm:
    return Palm(
        mass=raw["mass"],
        **{k: tuple(raw[k]) for k in ("inertial_pos", "inertial_quat", "diaginertia")},
        bounds_min=tuple(raw["mesh_bounds"]["min"]),
        bounds_max=tuple(raw["mesh_bounds"]["max"]),
    )


@cache
def figures() -> Figures:
    """Reads `figures.json` beside this file."""
    raw = json.loads(files("envs.hand").joinpath("figures.json").read_text("utf-8"))
    return Figures(
        palm=_palm(raw["palm"]),
        links=tuple(_link(link) for f in raw["fingers"] for link in f["links"]),
        kinematics_checks=tuple(
            (np.array(c["qpos"]), np.array(c["fingertip_in_palm"]))
            for c in raw["forward_kinematics_checks"]
        ),
    )
