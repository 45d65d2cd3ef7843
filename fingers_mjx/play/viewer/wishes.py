"""What the person at the page asks for, as plain data."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

PUSHES = {
    "forward": (1.0, 0.0, 0.0),
    "back": (-1.0, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
}
"""Directions of a push in V."""


@dataclass(frozen=True)
class Wishes:
    """The state of all knobs before a control step.

    Attributes:
        command: v_x, v_y [m/s] and yaw rate [rad/s], in V; None in tasks without.
        paused: whether time stands still.
        resets: how often a reset was asked for.
        push: towards where, out of `PUSHES`; None for no push.
        push_n: its force [N].
        effects: sizes of the effects of the drive that are on.
    """

    command: tuple[float, float, float] | None = None
    paused: bool = False
    resets: int = 0
    push: str | None = None
    push_n: float = 2.0
    effects: Mapping[str, float] = field(default_factory=dict)

    @property
    def command_v(self) -> Float[np.ndarray, "3"] | None:
        """The command as the environment keeps it [m/s, m/s, rad/s]."""
        return None if self.command is None else np.array(self.command, np.float32)

    @property
    def push_v(self) -> Float[np.ndarray, "3"]:
        """The force of the push in V [N]; zero without one."""
        direction = (0.0, 0.0, 0.0) if self.push is None else PUSHES[self.push]
        return self.push_n * np.array(direction)
