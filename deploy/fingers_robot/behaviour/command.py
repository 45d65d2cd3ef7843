"""From a gamepad to a command: dead-man, loss of the link, limits, ramps."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fingers_robot.reading import Array

Ranges = tuple[tuple[float, float], ...]

FRESH_S = 0.25
RAMP_S = 0.25
DEADZONE = 0.08


@dataclass(frozen=True, slots=True)
class Frame:
    """What a command source delivered last.

    Attributes:
        t_s: monotonic time at which it was known to be so [s].
        sticks: positions in [−1, 1], one per entry of the command.
        deadman: the dead-man button is held.
    """

    t_s: float
    sticks: tuple[float, ...]
    deadman: bool


class CommandSource(Protocol):
    """Where commands come from."""

    def poll(self, t: float) -> Frame | None:
        """Returns the newest frame; None before the first; never blocks."""
        ...

    def close(self) -> None:
        """Lets go of the device."""
        ...


class FixedCommand:
    """Always the same sticks, with the dead-man held: for simulation and tests.

    Args:
        sticks: positions in [−1, 1].
    """

    def __init__(self, sticks: tuple[float, ...]):
        self._sticks = sticks

    def poll(self, t: float) -> Frame:
        """Returns a fresh frame."""
        return Frame(t, self._sticks, True)

    def close(self) -> None:
        """Nothing to let go of."""


@dataclass(frozen=True, slots=True)
class CommandState:
    """The command on its way.

    Attributes:
        value: the command, in the units of the task.
        t_s: time of the step before [s].
    """

    value: Array
    t_s: float


def command_step(
    state: CommandState, frame: Frame | None, t: float, ranges: Ranges
) -> tuple[CommandState, float]:
    """Moves the command towards what the operator asks.

    Without the dead-man, or without a frame for 250 ms, the operator asks for nothing.
    Every entry moves at most over its whole range in 250 ms, so that it is at rest at
    most 250 ms after the loss was seen.

    Args:
        state: state after the step before.
        frame: newest frame.
        t: monotonic time [s].
        ranges: lowest and highest value of each entry in training.

    Returns:
        The new state, and the age of the frame [s].
    """
    age_s = np.inf if frame is None else t - frame.t_s
    wanted = rest_command(ranges)
    if frame is not None and frame.deadman and age_s <= FRESH_S:
        wanted = stick_command(frame.sticks, ranges)
    low, high = np.reshape(ranges, (-1, 2)).T
    dt_s = min(max(t - state.t_s, 0.0), RAMP_S)
    reach = np.maximum(high, -low) * dt_s / RAMP_S
    value = state.value + np.clip(wanted - state.value, -reach, reach)
    return CommandState(value, t), float(age_s)


def rest_command(ranges: Ranges) -> Array:
    """Zero, or the value of the range that is nearest to it."""
    low, high = np.reshape(ranges, (-1, 2)).T
    return np.clip(np.zeros(len(ranges)), low, high)


def stick_command(sticks: tuple[float, ...], ranges: Ranges) -> Array:
    """Maps sticks to commands: 0 to zero, ±1 to the ends of the training range.

    A range without negative values ignores that side of its stick.
    """
    command = rest_command(ranges)
    for i, ((low, high), stick) in enumerate(zip(ranges, sticks, strict=False)):
        beyond = max(abs(stick) - DEADZONE, 0.0) / (1.0 - DEADZONE)
        end = max(high, 0.0) if stick > 0 else max(-low, 0.0)
        command[i] = np.clip(np.copysign(beyond * end, stick), low, high)
    return command
