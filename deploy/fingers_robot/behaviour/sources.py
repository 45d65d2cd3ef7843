"""Where the inputs of a policy come from: gamepad, heading, keys, camera."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingers_deploy.manifest import Interface
from fingers_deploy.rotations import gravity, multiply
from fingers_robot.behaviour.command import (
    FRESH_S,
    CommandSource,
    CommandState,
    Frame,
    command_step,
    rest_command,
)
from fingers_robot.behaviour.exchange import Query
from fingers_robot.behaviour.heading import (
    HeadingConfig,
    heading,
    heading_step,
    wrap,
)
from fingers_robot.behaviour.keyboard.runner import KeyRunner
from fingers_robot.behaviour.task_inputs import OBJECT_TERMS, Given, reads, resized
from fingers_robot.behaviour.tracker_port import TrackerPort

_YAW = 2  # entry of the crawl command


@dataclass(frozen=True, slots=True)
class SourceSample:
    """What the sources delivered in one control step.

    Attributes:
        given: inputs by name of the term.
        age_s: age of what the policy depends on: gamepad, camera [s].
        moves: the policy may move the targets. A policy that reads no command cannot
            stand still by command: it is held while the dead-man button is not, and
            while the camera is silent.
    """

    given: Given
    age_s: float
    moves: bool


class Sources:
    """All sources of one run.

    Args:
        command: of commands and of the dead-man button.
        heading_hold: gains, for policies whose command has a yaw rate; None: off.
        keys: requests, for policies that press keys.
        tracker: camera, for policies that push an object.
    """

    def __init__(
        self,
        command: CommandSource,
        heading_hold: HeadingConfig | None = None,
        keys: KeyRunner | None = None,
        tracker: TrackerPort | None = None,
    ):
        self.command, self._hold = command, heading_hold
        self.keys, self.tracker = keys or KeyRunner(), tracker
        self._reference: float | None = None
        self._turned_rad = 0.0
        self._state = CommandState(np.zeros(0), 0.0)

    def rest(self) -> None:
        """Starts afresh, as while no policy runs."""
        self._reference = None

    def finish(self) -> tuple[str, ...]:
        """Lets go of the devices; returns what the operator should know of them."""
        self.command.close()
        said = [self.keys.story()]
        if self.tracker is not None:
            said.append(self.tracker.problem)
            self.tracker.close()
        return tuple(line for line in said if line)

    def poll(
        self, query: Query, interface: Interface, at_rest: bool = False
    ) -> SourceSample:
        """Reads every source.

        Args:
            query: of the supervisor.
            interface: of the policy that runs.
            at_rest: whatever the operator asks for, as if the dead-man button were not
                held.
        """
        t = query.t_s
        frame = self.command.poll(t)
        age_s = float("inf") if frame is None else t - frame.t_s
        held = frame is not None and frame.deadman and age_s <= FRESH_S
        if at_rest:
            frame, held = None, False
        given: dict[str, NDArray] = {
            "command": self._commanded(query, interface, frame, held, t)
        }
        presses = reads(interface, ("request",))
        if query.key:
            self.keys.ask(query.key - 1)
        may_ask = query.runs and presses and held
        given["request"] = self.keys.step(t, may_ask)
        if presses and self.keys.lost:
            age_s = float("inf")
        seen_s = self._see(query, given, t)
        if not reads(interface, OBJECT_TERMS):
            return SourceSample(given, age_s, moves=True)
        moves = held and seen_s <= FRESH_S
        return SourceSample(given, max(age_s, seen_s), moves)

    def _see(self, query: Query, given: dict[str, NDArray], t: float) -> float:
        """Adds what the camera sees; returns its age [s], without one infinite."""
        if self.tracker is None:
            return float("inf")
        age_s = self.tracker.poll(t)
        seen = self.tracker.inputs(gravity(query.quat_w))
        given |= dict(zip(OBJECT_TERMS, seen.reshape(3, 3), strict=True))
        return age_s

    def _commanded(
        self,
        query: Query,
        interface: Interface,
        frame: Frame | None,
        held: bool,
        t: float,
    ) -> NDArray[np.float32]:
        ranges = interface.command_ranges
        if len(self._state.value) != len(ranges):
            value = np.asarray(resized(self._state.value, len(ranges)), np.float64)
            rest = rest_command(ranges) if not len(self._state.value) else value
            self._state = CommandState(rest, self._state.t_s)
        self._state, _ = command_step(self._state, frame, t, ranges)
        command = self._state.value.astype(np.float32)
        turn = query.turned_rad - self._turned_rad
        self._turned_rad = query.turned_rad
        if self._hold is None or len(ranges) != _YAW + 1:
            return command
        quat = query.quat_w
        if not held or not np.isfinite(quat).all():
            # Nobody lets the hand turn: the heading at the next time is held then.
            self._reference = None
            return command
        yaw = heading(multiply(quat, interface.v_quat_b))
        if turn:
            held_rad = yaw if self._reference is None else self._reference
            self._reference = wrap(held_rad + turn)
        self._reference, rate = heading_step(
            self._reference, yaw, float(command[_YAW]), self._hold
        )
        command[_YAW] = np.clip(rate, *ranges[_YAW])
        return command
