"""Readings of a late sensor, put to when they were taken, for the joints beside it.

A joint whose sensor is late balances, seen by its own clock. To every other joint it
then seems to push too late, and nothing that such a joint has itself explains that.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sysid.diagnosis.measured.segments import Piece

READ = ("pos", "vel", "acc", "effort")
"""Fields of a piece that a joint's own sensor reads."""


@dataclass(frozen=True)
class Age:
    """How late a joint's readings are: L + d t after the start of a piece.

    Attributes:
        latency_s: L [s].
        drift: d [1].
    """

    latency_s: float
    drift: float


def in_time(
    pieces: Sequence[Piece], joints: Sequence[str], late: Mapping[str, Age]
) -> list[Piece]:
    """Returns pieces in which late joints stand where they were: x(t) of t (1 − d) − L.

    Args:
        pieces: stretches of records.
        joints: their columns.
        late: of the joints whose readings are late.
    """
    columns = {list(joints).index(joint): age for joint, age in late.items()}
    return [_in_time(piece, columns) for piece in pieces]


def _in_time(piece: Piece, late: Mapping[int, Age]) -> Piece:
    """Reads late joints later; behind the last reading they stay."""
    fields = {name: getattr(piece, name).copy() for name in READ}
    since = piece.t_s - piece.t_s[0]
    for j, age in late.items():
        read = (since + age.latency_s) / (1.0 - age.drift)
        for x in fields.values():
            x[:, j] = np.interp(read, since, x[:, j])
    return replace(piece, **fields)
