"""Effects of the actuator chain that are switched on and off while the hand walks."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.effect import EffectKind
from envs.hand.drive.chain import in_chain
from envs.hand.hand_file import Effect, HandFile
from envs.hand.quantity import Quantity

OFFERED = (
    "deadband",
    "backlash",
    "coulomb_friction",
    "stribeck_friction",
    "compliance",
    "command_quantization",
    "transport_delay",
    "sensor_latency",
)
"""What people suspect first; beside them stand those that the hand has."""
SPREADS = 2.0
"""How many factors of its prior above the median a size may be chosen."""


@dataclass(frozen=True)
class Switch:
    """One effect.

    Attributes:
        name: in the catalogue.
        equation: what it computes.
        unit: of its size.
        size: at which it starts.
        high: largest size that is offered.
        own: whether the hand has it by itself; its size is then the hand's.
    """

    name: str
    equation: str
    unit: str
    size: float
    high: float
    own: bool


def switches(hand: HandFile) -> tuple[Switch, ...]:
    """Returns the switches for a hand: its own effects first."""
    own = dict.fromkeys(e.name for e in hand.effects if in_chain(CATALOGUE[e.name]))
    names = [*own, *(name for name in OFFERED if name not in own)]
    return tuple(_switch(CATALOGUE[name], name in own) for name in names)


def own_effects(hand: HandFile) -> dict[str, float]:
    """Returns what is on at the start: the hand's own effects."""
    return {s.name: s.size for s in switches(hand) if s.own}


def switched(hand: HandFile, on: Mapping[str, float]) -> HandFile:
    """Returns the hand with every offered effect, those that are off at their identity.

    So that all hands that differ by switches run the same program.

    Args:
        hand: as it is by itself.
        on: sizes of the effects that are on; an effect of the hand's own keeps its own.
    """
    own = own_effects(hand)
    kept = [e if e.name in on or e.name not in own else _off(e) for e in hand.effects]
    new = [_effect(CATALOGUE[n], on.get(n)) for n in OFFERED if n not in own]
    return dataclasses.replace(hand, effects=(*kept, *new))


def _switch(kind: EffectKind, own: bool) -> Switch:
    parameter = kind.parameters[_size_name(kind)]
    prior = parameter.prior
    high = min(parameter.high, prior.center * prior.spread**SPREADS)
    return Switch(kind.name, kind.equation, parameter.unit, prior.center, high, own)


def _size_name(kind: EffectKind) -> str:
    """Returns the parameter at whose identity the effect vanishes."""
    return next(k for k, p in kind.parameters.items() if p.identity is not None)


def _effect(kind: EffectKind, size: float | None) -> Effect:
    """Returns an effect of all joints; without a size, one that does nothing."""
    values = kind.identity()
    if size is not None:
        values = {k: p.prior.center for k, p in kind.parameters.items()}
        values[_size_name(kind)] = size
    return Effect(kind.name, _quantities(kind, values))


def _off(effect: Effect) -> Effect:
    """Returns an effect of the hand's own that does nothing, where it was."""
    kind = CATALOGUE[effect.name]
    return dataclasses.replace(effect, parameters=_quantities(kind, kind.identity()))


def _quantities(kind: EffectKind, values: Mapping[str, float]) -> dict[str, Quantity]:
    return {
        name: Quantity(float(values[name]), parameter.unit, "user")
        for name, parameter in kind.parameters.items()
    }
