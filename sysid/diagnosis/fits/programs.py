"""Which candidates are simulated side by side, and by which program.

A program is compiled for a set of effects, and every effect in it takes time, acting or
not. Compiled for each set that comes, programs cost more than what they save; with all
effects in one, every simulation takes five times as long. So most effects, which cost
next to nothing, are always there, and a candidate's program is chosen by the others.
"""

from collections.abc import Collection, Iterator

import numpy as np
from jaxtyping import Bool, Float

from sysid.diagnosis.fits.parameters import Space
from sysid.diagnosis.replay.effects import KINDS

COSTLY = (
    "payload_com",
    "encoder_eccentricity",
    "torque_slope_limit",
    "thermal_derating",
    "backlash",
    "compliance",
    "hysteresis",
)
"""Effects that take longer than a tenth of a simulation each."""

MOST = 2
"""Number of sets of costly effects that have programs of their own in one call; more
of them share that of all, or of all but those that are `APART`."""


APART = ("compliance",)
"""Effects that act on others by being there, at any size: beside a spring a play has a
motor without inertia (`simulated/play.py`). Only those share its program that have
it."""

Program = tuple[str, ...]
"""What is compiled: the effects that it simulates, in the order of the chain."""


def programs(
    space: Space, thetas: Float[np.ndarray, "c n"]
) -> Iterator[tuple[Program, np.ndarray]]:
    """Yields programs and the candidates that each of them simulates.

    Args:
        space: coordinates.
        thetas: coordinates of candidates [1].
    """
    acting = np.stack([_acts(space, thetas, name) for name in COSTLY], 1)
    kinds = np.unique(acting, axis=0)
    if np.count_nonzero(kinds.any(1)) > MOST:
        shared = [name not in APART for name in COSTLY]
        acting[:, shared] |= acting.any(1, keepdims=True)
        kinds = np.unique(acting, axis=0)
    for kind in kinds:
        some = {name for name, there in zip(COSTLY, kind, strict=True) if there}
        yield program_of(space, some), np.flatnonzero((acting == kind).all(1))


def program_of(space: Space, costly: Collection[str]) -> Program:
    """Returns the program that has some of the costly effects, and all others.

    Args:
        space: coordinates.
        costly: names of effects; those that the space lacks do not count.
    """
    chain = (e for e in space.effects if e in KINDS)
    return tuple(e for e in chain if e not in COSTLY or e in costly)


def _acts(space: Space, thetas: np.ndarray, effect: str) -> Bool[np.ndarray, " c"]:
    """Where an effect changes anything."""
    sizes = [i for i in space.of(effect) if space.slots[i].is_size]
    return np.any(thetas[:, sizes] != 0.0, axis=1)
