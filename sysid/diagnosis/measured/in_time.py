"""Readings of a sensor, put to when and where it was, for the joints beside it.

A joint whose sensor is late balances, seen by its own clock. To every other joint it
then seems to push too late, and nothing that such a joint has itself explains that. And
a joint whose encoder counts too much follows its targets as ever, but hangs elsewhere.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sysid.diagnosis.measured.segments import Piece

ANGLES = ("pos", "vel", "acc")
READ = (*ANGLES, "effort")
"""Fields of a piece that a joint's own sensor reads; angles are what it scales."""


@dataclass(frozen=True)
class Sensor:
    """What a joint's sensor reads: y(t) = s x(t (1 − d) − L) from the start of a piece.

    Attributes:
        latency_s: L [s].
        drift: d [1].
        scale: s, of angles alone [1].
    """

    latency_s: float = 0.0
    drift: float = 0.0
    scale: float = 1.0


def in_time(
    pieces: Sequence[Piece], joints: Sequence[str], sensors: Mapping[str, Sensor]
) -> list[Piece]:
    """Returns pieces where joints stand as they were: x(t) = y((t + L) / (1 − d)) / s.

    Args:
        pieces: stretches of records.
        joints: their columns.
        sensors: of the joints whose readings are late or too large.
    """
    columns = {list(joints).index(joint): s for joint, s in sensors.items()}
    return [_in_time(piece, columns) for piece in pieces]


def _in_time(piece: Piece, sensors: Mapping[int, Sensor]) -> Piece:
    """Reads late joints later; behind the last reading they stay."""
    fields = {name: getattr(piece, name).copy() for name in READ}
    since = piece.t_s - piece.t_s[0]
    for j, sensor in sensors.items():
        read = (since + sensor.latency_s) / (1.0 - sensor.drift)
        for name, x in fields.items():
            scale = sensor.scale if name in ANGLES else 1.0
            x[:, j] = np.interp(read, since, x[:, j]) / scale
    return replace(piece, **fields)
