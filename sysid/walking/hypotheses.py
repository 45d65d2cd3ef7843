"""What may be wrong with a hand that walks: hypotheses with their parameters."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from envs.actuator.catalogue import CATALOGUE
from envs.hand.hand_file import Effect, HandFile
from envs.hand.nominal import FINGERS
from envs.hand.quantity import Quantity

NUISANCE = "tip_friction"
"""What every hypothesis may choose along: floors differ."""


@dataclass(frozen=True)
class Axis:
    """One parameter of one hypothesis, in units of `unit`.

    Attributes:
        effect, where, name: which parameter.
        unit: size of one step of the search, in the parameter's own unit; for a
            parameter whose identity is 1, of its logarithm.
    """

    effect: str
    where: str
    name: str
    unit: float

    @property
    def logarithmic(self) -> bool:
        """Whether the identity is 1."""
        return CATALOGUE[self.effect].parameters[self.name].identity == 1.0

    def value(self, x: float) -> float:
        """Returns the parameter."""
        return float(np.exp(self.unit * x)) if self.logarithmic else self.unit * x


@dataclass(frozen=True)
class Hypothesis:
    """One effect at one place, by its parameters' indices in `axes()`."""

    effect: str
    where: str
    indices: tuple[int, ...]


def axes() -> tuple[Axis, ...]:
    """Returns all parameters, the nuisance first."""
    found = [Axis(NUISANCE, "all", "scale", 0.1)]
    found += [Axis("finger_weakness", f, "strength", 0.1) for f in FINGERS]
    found += [Axis("friction_anisotropy", "all", "split", 0.1)]
    found += [Axis("payload_com", "all", f"{a}_m", 0.01) for a in "xyz"]
    found += [Axis("floor_tilt", "all", f"{a}_rad", 0.02) for a in ("roll", "pitch")]
    found += [Axis("imu_bias", "all", f"{a}_rad_s", 0.02) for a in "xyz"]
    return tuple(found)


def hypotheses(all_axes: tuple[Axis, ...]) -> tuple[Hypothesis, ...]:
    """Returns the hypotheses that the axes belong to."""
    places = dict.fromkeys((a.effect, a.where) for a in all_axes)
    return tuple(
        Hypothesis(
            effect,
            where,
            tuple(
                i
                for i, a in enumerate(all_axes)
                if (a.effect, a.where) == (effect, where)
            ),
        )
        for effect, where in places
        if effect != NUISANCE
    )


def whole_hand(hand: HandFile) -> HandFile:
    """Returns a hand with all effects of the axes at their identity."""
    effects = []
    for name in dict.fromkeys(axis.effect for axis in axes()):
        kind = CATALOGUE[name]
        units = kind.units()
        values = {
            key: Quantity(float(value), units[key], "ours")
            for key, value in kind.identity().items()
        }
        effects.append(Effect(name, values))
    return replace(hand, effects=tuple(effects))


def candidate(
    theta: Float[np.ndarray, " a"], all_axes: tuple[Axis, ...]
) -> Mapping[str, Mapping[str, Any]]:
    """p_i = u_i θ_i, or exp(u_i θ_i) where the identity is 1, by effect and name.

    Args:
        theta: coordinates, in units u_i of their axes [1].
        all_axes: of the coordinates.

    Returns:
        Parameters as the simulation takes them: strength by joint (20), friction by
        fingertip (5), the others alone [1, m, rad, rad/s].

    Source:
        Ours: factors vary by percents, not by amounts.
    """
    found: dict[str, dict[str, Any]] = {}
    for x, axis in zip(theta, all_axes, strict=True):
        value: Any = axis.value(float(x))
        if axis.effect == "finger_weakness":
            whole = found.setdefault(axis.effect, {}).get(axis.name, np.ones(20))
            first = 4 * FINGERS.index(axis.where)
            whole[first : first + 4] = value
            value = whole
        elif axis.effect == NUISANCE:
            value = np.full(len(FINGERS), value)
        found.setdefault(axis.effect, {})[axis.name] = value
    return {
        effect: {k: jnp.asarray(v, jnp.float32) for k, v in parameters.items()}
        for effect, parameters in found.items()
    }
