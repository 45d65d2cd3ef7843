"""Coordinates in which candidates are searched: one for every parameter.

    linear      x = s u         zero is the identity
    log         x = s eᵘ        factors, and parameters that only shape an effect
    reciprocal  x = s / u       limits and cutoffs, which vanish at infinity: u = 0

Scales s come from what occurs in the records, so a heavy axis and a finger joint look
alike, and a change of unit changes nothing.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import ArrayLike, Float

from envs.actuator.catalogue import CATALOGUE
from sysid.diagnosis.replay.model import Nuisance

NUISANCE = ""
Kind = Literal["linear", "log", "reciprocal"]


@dataclass(frozen=True)
class Slot:
    """One coordinate.

    Attributes:
        effect, name: parameter; the effect is "" for what belongs to none.
        unit: of the parameter.
        kind, scale: how coordinate and parameter go together; see the module.
        nominal: coordinate in the nominal simulation.
        low, high: range of the search.
        prior_sd: prior standard deviation; 0: fixed unless released; inf: free.
        starts: coordinates from which a search begins.
        vanishes: whether the effect is absent at `nominal`.
        many_optima: whether it has many local optima, as the step of a grid has.
        released_sd: prior standard deviation once it is released.
    """

    effect: str
    name: str
    unit: str
    kind: Kind
    scale: float
    nominal: float
    low: float
    high: float
    prior_sd: float
    starts: tuple[float, ...]
    vanishes: bool
    many_optima: bool = False
    released_sd: float = 5.0

    @property
    def is_size(self) -> bool:
        """Whether the parameter is a size of its effect, and not only its shape."""
        return CATALOGUE[self.effect].parameters[self.name].identity is not None

    def value(self, u: Float[ArrayLike, "*c"]) -> Float[np.ndarray, "*c"]:
        """Parameter at a coordinate: x = s u, s eᵘ or s / u; see the module.

        Args:
            u: coordinates [1]; negative ones of a reciprocal count as zero.

        Returns:
            Values in the unit of the parameter; ∞ at u = 0 of a reciprocal.

        Source:
            Ours.
        """
        return _value(self.kind, self.scale, np.asarray(u))

    def coordinate(self, x: float) -> float:
        """Returns the coordinate of a value."""
        if self.kind == "linear":
            return x / self.scale
        if self.kind == "log":
            return math.log(max(x, 1e-12) / self.scale)
        return self.scale / x

    @property
    def label(self) -> str:
        """Name for messages: `effect.name`, or the name of a nuisance parameter."""
        return f"{self.effect}.{self.name}".lstrip(".")

    def shift(self, u: float) -> float:
        """Distance of a coordinate from nominal [prior standard deviations]."""
        return abs(u - self.nominal) / self.prior_sd


@dataclass(frozen=True)
class Space:
    """All coordinates of the candidates of one joint."""

    slots: tuple[Slot, ...]

    @property
    def nominal(self) -> Float[np.ndarray, " n"]:
        """The nominal simulation."""
        return np.array([s.nominal for s in self.slots])

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects in the order of the chain."""
        return tuple(dict.fromkeys(s.effect for s in self.slots if s.effect))

    def of(self, effect: str) -> list[int]:
        """Indices of the coordinates of an effect."""
        return [i for i, s in enumerate(self.slots) if s.effect == effect]

    def has_nominal(self, effect: str) -> bool:
        """Whether the simulation has nominal values of all parameters of an effect."""
        return all(self.slots[i].prior_sd > 0.0 for i in self.of(effect))

    def nuisances(self) -> list[int]:
        """Indices of the coordinates that every candidate may adjust."""
        return [i for i, s in enumerate(self.slots) if s.prior_sd > 0.0]

    def prior_sds(self, released: Sequence[str]) -> Float[np.ndarray, " n"]:
        """Prior standard deviations: σ_i = `released_sd` if released, else `prior_sd`.

        Args:
            released: effects whose parameters may leave their tolerances.

        Returns:
            σ in units of the coordinates' scales [1]; 0 for what stays fixed.

        Source:
            Ours.
        """
        return np.array(
            [
                s.released_sd if s.effect in released else min(s.prior_sd, _FREE)
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

    def values(self, theta: Float[np.ndarray, "c n"]) -> tuple[dict, Nuisance]:
        """Values x_i = s_i u_i, s_i e^{u_i} or s_i / u_i of candidates; see `Slot`.

        Args:
            theta: coordinates u of candidates [1], in double precision.

        Returns:
            Parameters by effect and name, and nuisance parameters, in their units.

        Source:
            Ours.
        """
        x = np.empty(theta.T.shape, np.float32)
        for kind, (rows, scales) in self._kinds.items():
            with np.errstate(over="ignore"):  # no limit is infinite
                x[rows] = _value(kind, scales, theta.T[rows])
        params: dict[str, dict] = {}
        nuisance = {}
        for row, slot in zip(x, self.slots, strict=True):
            if slot.effect:
                params.setdefault(slot.effect, {})[slot.name] = row
            else:
                nuisance[slot.name] = row
        for name in ("push_gain", "ripple", "k_int"):
            nuisance.setdefault(name, np.ones(len(theta), np.float32))
        return params, Nuisance(**nuisance)

    @cached_property
    def _kinds(self) -> dict[Kind, tuple[list[int], np.ndarray]]:
        """Indices of the coordinates of each kind, and a column of their scales."""
        rows: dict[Kind, list[int]] = {}
        for i, s in enumerate(self.slots):
            rows.setdefault(s.kind, []).append(i)
        scales = np.array([s.scale for s in self.slots])[:, None]
        return {kind: (found, scales[found]) for kind, found in rows.items()}

    def local(self) -> list[int]:
        """Indices of what belongs to a record and not to the mechanism."""
        return [i for i, s in enumerate(self.slots) if s.name in _LOCAL]


def _value(kind: Kind, scale: float | np.ndarray, u: np.ndarray) -> np.ndarray:
    """The parameter x = s u, s eᵘ or s / u; see the module."""
    if kind == "linear":
        return np.asarray(scale * u)
    if kind == "log":
        return np.asarray(scale * np.exp(u))
    with np.errstate(divide="ignore"):
        return np.asarray(scale / np.maximum(u, 0.0))


_FREE = 5.0
_LOCAL = ("push_gain", "ripple")
"""Nuisance parameters of a record: how an effort that jumps with its targets is read,
few moments show, and without them it goes where noise does."""
_LOGS = ("stiffness", "damping", "encoder_scale")
