"""Packets between the simulated hand and its driver, over a local socket."""

import enum

import numpy as np
from numpy.typing import NDArray

from fingers_robot.reading import JOINT_COUNT


class Ask(enum.IntEnum):
    """What the driver asks of the simulator.

    TARGET: take these joint targets.
    ENABLE, DISABLE: energize, de-energize.
    """

    TARGET = 1
    ENABLE = 2
    DISABLE = 3


REQUEST = np.dtype([("ask", "<i4"), ("target", "<f8", JOINT_COUNT)])
"""One request; `target` counts for TARGET."""

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
"""The simulated hand's state: what its sensors measure, and the palm's true pose."""


def request(ask: Ask, target: NDArray | None = None) -> bytes:
    """Packs one request."""
    packet = np.zeros((), REQUEST)
    packet["ask"], packet["target"] = ask, np.nan if target is None else target
    return packet.tobytes()
