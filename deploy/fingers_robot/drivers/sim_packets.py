"""Packets between the simulated hand and its driver, over a local socket."""

import enum

import numpy as np
from numpy.typing import NDArray

from fingers_deploy.manifest import JOINT_COUNT


class Ask(enum.IntEnum):
    """What the driver asks of the simulator.

    TARGET: take these joint targets.
    ENABLE, DISABLE: energize, de-energize.
    ADVANCE: lockstep only; advance to the time in `t_s`, then answer.
    """

    TARGET = 1
    ENABLE = 2
    DISABLE = 3
    ADVANCE = 4


REQUEST = np.dtype([("ask", "<i4"), ("t_s", "<f8"), ("target", "<f8", JOINT_COUNT)])
"""One request; `target` counts for TARGET and ADVANCE, NaN there: as before."""

STATE = np.dtype(
    [
        ("t_s", "<f8"),
        ("health_t_s", "<f8"),
        ("enabled", "<i4"),
        ("pos", "<f8", JOINT_COUNT),
        ("effort", "<f8", JOINT_COUNT),
        ("quat", "<f8", 4),
        ("gyro", "<f8", 3),
        ("base_pos", "<f8", 3),
        ("base_quat", "<f8", 4),
    ]
)
"""The simulated hand's state: what its sensors tell, and the true pose of the palm."""


def request(ask: Ask, t_s: float = 0.0, target: NDArray | None = None) -> bytes:
    """Packs one request."""
    packet = np.zeros((), REQUEST)
    packet["ask"], packet["t_s"] = ask, t_s
    packet["target"] = np.nan if target is None else target
    return packet.tobytes()
