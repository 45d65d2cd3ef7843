"""Coordinates in which candidates are searched: one for every parameter.

    linear      x = s u         zero is the identity
    log         x = s eᵘ        factors, and parameters that only shape an effect
    reciprocal  x = s / u       limits and cutoffs, which vanish at infinity: u = 0

Sizes s come from what occurs in the records, so a heavy axis and a finger joint look
alike, and a change of unit changes nothing.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.effect import Parameter
from sysid.diagnosis.replay.residuals import joint_effects
from sysid.diagnosis.replay.track import JointTrack
from sysid.mechanism import JointDrive, Nominal

SIGMA = 3.0**-0.5
"""Deviation of a figure that may be anywhere within its tolerance, in tolerances."""

SKEW_S = 5e-4
"""Largest age of the angle against the effort that is no news [s]."""

HOLD_S = 5e-4
"""Largest mean age of an acting torque that is no news: a servo of 1 kHz keeps one for
a millisecond [s]."""

DELAY_S = 1e-3
"""Largest deviation of a known delay that is no news, whatever its tolerance [s]."""

MASS = 0.05
"""Largest relative deviation of masses and inertias that is no news."""

ZERO_RAD = 1e-3
"""Largest error of an encoder's zero that is no news, where none is told [rad]."""

ROTOR = 1.0
"""Largest logarithm by which the motor's share of a joint's inertia may be wrong."""

NUISANCE = ""
Kind = Literal["linear", "log", "reciprocal"]


@dataclass(frozen=True)
class Slot:
    """One coordinate.

    Attributes:
        effect, name: parameter; the effect is "" for what belongs to none.
        unit: of the parameter.
        kind, scale: how coordinate and parameter go together; see the module.
        base: coordinate in the simulation as it stands.
        low, high: range of the search.
        tight: prior deviation; 0: fixed unless released; inf: free.
        starts: coordinates from which a search begins.
        vanishes: whether the effect is absent at `base`.
        wide: prior deviation once it is released.
        comb: whether it has many optima beside each other, as the step of a grid has.
    """

    effect: str
    name: str
    unit: str
    kind: Kind
    scale: float
    base: float
    low: float
    high: float
    tight: float
    starts: tuple[float, ...]
    vanishes: bool
    comb: bool = False
    wide: float = 5.0

    def value(self, u: Float[np.ndarray, "*c"]) -> Float[np.ndarray, "*c"]:
        """Returns the parameter at a coordinate."""
        if self.kind == "linear":
            return self.scale * u
        if self.kind == "log":
            return self.scale * np.exp(u)
        with np.errstate(divide="ignore"):
            return self.scale / np.maximum(u, 0.0)

    def coordinate(self, x: float) -> float:
        """Returns the coordinate of a value."""
        if self.kind == "linear":
            return x / self.scale
        if self.kind == "log":
            return math.log(max(x, 1e-12) / self.scale)
        return self.scale / x


@dataclass(frozen=True)
class Space:
    """All coordinates of the candidates of one joint."""

    slots: tuple[Slot, ...]

    @property
    def base(self) -> Float[np.ndarray, " n"]:
        """The simulation as it stands."""
        return np.array([s.base for s in self.slots])

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects in the order of the chain."""
        return tuple(dict.fromkeys(s.effect for s in self.slots if s.effect))

    def of(self, effect: str) -> list[int]:
        """Indices of the coordinates of an effect."""
        return [i for i, s in enumerate(self.slots) if s.effect == effect]

    def figured(self, effect: str) -> bool:
        """Tells whether the simulation has all figures of an effect."""
        return all(self.slots[i].tight > 0.0 for i in self.of(effect))

    def nuisances(self) -> list[int]:
        """Indices of the coordinates that every candidate may adjust."""
        return [i for i, s in enumerate(self.slots) if s.tight > 0.0]

    def deviations(self, released: Sequence[str]) -> Float[np.ndarray, " n"]:
        """Prior deviations with some effects released; 0 for what stays fixed."""
        return np.array(
            [
                s.wide if s.effect in released else min(s.tight, _FREE)
                for s in self.slots
            ]
        )

    def starts(self, effect: str) -> list[dict[int, float]]:
        """Coordinates of an effect from which searches begin.

        Sizes are tried one at a time, each with every shape; shares also all at once,
        for what one share does alone may be the opposite of what they do together.
        """
        indices = self.of(effect)
        sizes = [i for i in indices if self.slots[i].kind != "log" or effect in _LOGS]
        shapes = [i for i in indices if i not in sizes]
        grids = [self.slots[i].starts for i in shapes]
        tried = [{i: u} for i in sizes for u in self.slots[i].starts]
        if len(sizes) > 1 and all(self.slots[i].unit == "1" for i in sizes):
            tried += [dict.fromkeys(sizes, u) for u in self.slots[sizes[0]].starts]
        return [
            {**some, **dict(zip(shapes, us, strict=True))}
            for some in tried
            for us in itertools.product(*grids)
        ]

    def values(self, theta: Float[np.ndarray, "c n"]) -> tuple[dict, dict]:
        """Returns (parameters by effect, nuisances) of candidates."""
        params: dict[str, dict] = {}
        nuisance = {}
        for column, slot in zip(theta.T, self.slots, strict=True):
            x = slot.value(column).astype(np.float32)
            if slot.effect:
                params.setdefault(slot.effect, {})[slot.name] = x
            else:
                nuisance[slot.name] = x
        nuisance.setdefault("push_gain", np.ones(len(theta), np.float32))
        return params, nuisance

    def local(self) -> list[int]:
        """Indices of what belongs to a record and not to the mechanism."""
        return [i for i, s in enumerate(self.slots) if s.name == "push_gain"]


_FREE = 5.0
_LOGS = ("stiffness", "damping", "encoder_scale")


def make_space(track: JointTrack, drive: JointDrive, known: dict[str, bool]) -> Space:
    """Makes the coordinates of one joint.

    Args:
        track: the records, for sizes.
        drive: what the simulation has, and tolerances.
        known: which surroundings are known, by field name.
    """
    slots = [
        _pseudo("effort_gain", "1", "log", 1.0, drive.effort_scale.tolerance),
        _pseudo("mass", "1", "log", 1.0, MASS),
        _pseudo("skew_s", "s", "linear", 1e-3, SKEW_S / 1e-3),
        _pseudo("hold_s", "s", "linear", 1e-3, HOLD_S / 1e-3),
    ]
    inertia = float(np.mean(np.asarray(track.track.inertia)))
    rotor = 0.5 * track.armature if track.armature > 0.0 else 0.1 * inertia
    slots.append(_pseudo("rotor", "kg·m²", "log", rotor, ROTOR))
    if np.any(np.asarray(track.track.ext)):
        free = _pseudo("push_gain", "1", "linear", 1.0, math.inf)
        slots.append(replace(free, base=1.0))
    if drive.effort_scale.free:
        slots[0] = replace(slots[0], tight=math.inf)
    sizes = _sizes(track)
    for effect in joint_effects():
        kind = CATALOGUE[effect]
        if all(known.get(name, False) for name in kind.needs):
            figures = _figures(drive, effect, track)
            for name, parameter in kind.parameters.items():
                figure = figures.get(name)
                made = _slot(effect, name, parameter, figure, sizes, track.slide)
                slots.append(made)
    return Space(tuple(slots))


def _pseudo(name: str, unit: str, kind: Kind, scale: float, tight: float) -> Slot:
    sigma = SIGMA * tight
    return Slot(NUISANCE, name, unit, kind, scale, 0.0, -10.0, 10.0, sigma, (), False)


def _figures(drive: JointDrive, effect: str, track: JointTrack) -> dict[str, Nominal]:
    """Returns what the simulation has of an effect."""
    if effect == "stiffness":
        return {"scale": replace(drive.kp, value=1.0)}
    if effect == "damping":
        return {"scale": replace(drive.kd, value=1.0)}
    found = drive.effects.get(effect, {})
    if effect == "armature" and not found:
        # Masses scale all of it; drive and links may be wrong in opposite ways.
        known = math.sqrt(2.0) * track.armature
        inertia = known or float(np.mean(np.asarray(track.track.inertia)))
        return {"inertia_kgm2": Nominal(0.0, MASS * inertia)}
    if effect == "payload_mass" and not found:
        return {"mass_kg": Nominal(0.0, MASS * float(np.mean(track.track.payload_kg)))}
    if effect == "encoder_offset" and not found and not track.slide:
        return {"offset_rad": Nominal(0.0, ZERO_RAD)}
    return found


def _sizes(track: JointTrack) -> dict[str, float]:
    """Returns a size that matters for every unit."""
    torque, speed, angle = track.torque_scale, track.speed_scale, track.angle_scale
    inertia = max(float(np.mean(np.asarray(track.track.inertia))), 1e-12)
    return {
        "N·m": torque,
        "rad": 0.1 * angle,
        "rad/s": speed,
        "N·m·s/rad": torque / speed,
        "kg·m²": inertia,
        "N·m/s": torque / 0.03,
        "1/(N·m)": 1.0 / torque,
        "1/(N·m)²": 1.0 / torque**2,
        "rad/(N·m)": 0.05 * angle / torque,
        "N·m/rad": torque / angle,
        "s": 0.02,
    }


_GRIDS = {
    "rad": (0.004, 0.01, 0.025, 0.06, 0.15, 0.4),
    # Half the width of a resonance apart: ω ∝ 1 / √C.
    "rad/(N·m)": tuple(np.geomspace(0.003, 1.5, 20).tolist()),
}
_TEETH = (0.015, 1.0)
_RECIPROCAL = {
    "N·m": (1.0, 1.2, 1.6),
    "rad/s": (0.6, 0.9, 1.2, 1.8),
    # A little too tight a limit is far worse than none: its optimum is narrow.
    "N·m/s": tuple(np.geomspace(0.1, 2.0, 17).tolist()),
}


def _slot(
    effect: str,
    name: str,
    parameter: Parameter,
    figure: Nominal | None,
    sizes: dict[str, float],
    slide: bool,
) -> Slot:
    """Makes the coordinate of one parameter."""
    prior, identity = parameter.prior, parameter.identity
    size = sizes.get(parameter.unit)
    if identity is None:  # a shape: any positive size
        scale = prior.center
        if size is not None and parameter.unit != "s":
            scale = 0.1 * size
        spread = math.log(prior.spread)
        reach, some = 3.0 * spread + 2.0, 1.2 * spread
        slot = Slot(effect, name, parameter.unit, "log", scale, 0.0, -reach, reach,
                    0.0, (-some, 0.0, some), True)  # fmt: skip
    elif math.isinf(identity):
        scale = size if size is not None else prior.center
        starts = _RECIPROCAL.get(parameter.unit, (0.1, 0.3, 1.0, 2.0))
        slot = Slot(effect, name, parameter.unit, "reciprocal", scale, 0.0, 0.0, 50.0,
                    0.0, starts, True)  # fmt: skip
    elif identity == 1.0:
        slot = Slot(effect, name, parameter.unit, "log", 1.0, 0.0, -4.0, 4.0, 0.0,
                    (-0.3, -0.05, 0.05, 0.3), True)  # fmt: skip
        slot = replace(slot, wide=3.0 * math.log(prior.spread))
    else:
        scale = size
        if scale is None:
            scale = prior.spread if prior.kind == "normal" else prior.center
        signed = parameter.low < 0.0
        grid = _GRIDS.get(parameter.unit, (0.1,))
        if size is None:
            grid = (0.5,)
        starts = (0.1, -0.1) if signed else grid
        low = -30.0 if signed else 0.0
        slot = Slot(effect, name, parameter.unit, "linear", scale, 0.0, low, 30.0,
                    0.0, starts, True)  # fmt: skip
    if effect == "command_quantization":
        slot = replace(slot, comb=True, starts=_TEETH)
    slot = slot if slide else _bounded(slot, parameter)
    return slot if figure is None else _known(slot, figure)


def _bounded(slot: Slot, parameter: Parameter) -> Slot:
    """Keeps a coordinate within the range of its parameter."""
    if slot.kind == "reciprocal":
        return replace(slot, high=min(slot.high, slot.coordinate(parameter.low)))
    ends = [slot.coordinate(x) if x != 0.0 or slot.kind == "linear" else slot.low
            for x in (parameter.low, parameter.high)]  # fmt: skip
    return replace(slot, low=max(slot.low, ends[0]), high=min(slot.high, ends[1]))


def _known(slot: Slot, figure: Nominal) -> Slot:
    """Places a coordinate at the figure that the simulation has."""
    absent = figure.value == 0.0 and slot.kind == "linear"
    base = slot.coordinate(figure.value)
    if slot.kind == "log":
        tight = figure.tolerance
    elif absent:
        tight = figure.tolerance / slot.scale
    else:
        tight = figure.tolerance * abs(base)
    if slot.unit == "s":
        tight = max(tight, DELAY_S / slot.scale)
    starts = slot.starts
    if slot.kind != "log" and not absent:
        near = (0.5 * base, 0.8 * base, 1.25 * base, 2.0 * base)
        starts = near + tuple(u for u in starts if u > base)
    low = min(slot.low, -0.8) if slot.effect == "armature" else slot.low
    return replace(
        slot,
        base=base,
        low=low,
        tight=math.inf if figure.free else SIGMA * tight,
        starts=starts,
        vanishes=absent or slot.effect in ("stiffness", "damping"),
    )
