"""The policy's side of the link: which policy runs, with what command.

    operator selects ──► policy ──(recovery, upright)──► settle ramp ──► first policy

A recovery policy that is the first itself goes on holding the stance after the ramp.
While the supervisor does not let the policy run, every policy starts afresh at the
targets on the wire.
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from fingers_deploy.behaviour.command import (
    CommandSource,
    CommandState,
    command_step,
    rest_command,
)
from fingers_deploy.behaviour.hand_over import (
    Moment,
    asked_for,
    build_history,
    resized,
)
from fingers_deploy.behaviour.heading import HeadingConfig, heading_step
from fingers_deploy.behaviour.settle import Ramp, settle_ramp
from fingers_deploy.behaviour.upright import tilt_angle, upright_step
from fingers_deploy.controller import PolicyController
from fingers_deploy.rotations import gravity, heading, multiply
from fingers_deploy.runtime.link import encode_answer
from fingers_deploy.safety.detect_policy import complement
from fingers_deploy.safety.types import PolicyFault, Proposal

Array = NDArray[np.float64]
RECOVERY = "recovery"
_YAW = 2  # entry of the crawl command


class Policies:
    """One or more policies and the source of their command.

    Args:
        controllers: the policies; the first is the one to which recovery leads.
        source: of the command.
        heading_hold: gains, for policies whose command has a yaw rate; None: off.
    """

    def __init__(
        self,
        controllers: tuple[PolicyController, ...],
        source: CommandSource,
        heading_hold: HeadingConfig | None = None,
    ):
        self._controllers, self._source = controllers, source
        self._hold = heading_hold
        longest = max(
            term.history
            for c in controllers
            for term in c.bundle.manifest.interface.observation.terms
        )
        self._moments: deque[Moment] = deque(maxlen=longest + 1)
        self._active = self._selected = 0
        self._ramp: Ramp | None = None
        self._upright_s, self._reference = np.inf, None
        self._state = CommandState(rest_command(self._ranges(0)), 0.0)

    @property
    def active(self) -> int:
        """Number of the policy that runs."""
        return self._active

    @property
    def settling(self) -> bool:
        """Whether a ramp moves the targets, or holds them where it ended."""
        return self._ramp is not None

    def answer(self, packet: np.void) -> bytes:
        """Answers one observation of the supervisor."""
        t, target = float(packet["t_s"]), packet["target"]
        if not packet["runs"]:
            self._rest(packet)
        elif int(packet["policy"]) != self._selected:
            self._select(int(packet["policy"]), target)
        command, age_s = self._command(packet["quat"], t)
        fault = PolicyFault.NONE
        if packet["runs"] and self._ramp is not None:
            target = self._follow_ramp(packet, command, t)
        elif packet["runs"]:
            target, fault = self._run(packet, command)
            self._look_for_upright(packet, target, t)
        tick, challenge = int(packet["tick"]), int(packet["challenge"])
        proposal = Proposal(
            tick, complement(challenge), np.asarray(target, np.float64), age_s, fault
        )
        return encode_answer(proposal, command, self._active)

    def _rest(self, packet: np.void) -> None:
        """Everything starts afresh at the targets on the wire."""
        self._moments.clear()
        self._ramp, self._upright_s, self._reference = None, np.inf, None
        selected = int(packet["policy"])
        if 0 <= selected < len(self._controllers):
            self._active = self._selected = selected
        if np.isfinite(packet["target"]).all():
            self._controllers[self._active].reset(packet["target"])

    def _select(self, number: int, target: Array) -> None:
        if not 0 <= number < len(self._controllers):
            return
        self._selected = number
        self._ramp, self._upright_s = None, np.inf
        self._hand_over(number, target)

    def _hand_over(self, number: int, target: Array) -> None:
        controller = self._controllers[number]
        interface = controller.bundle.manifest.interface
        history, action = build_history(
            tuple(self._moments), interface, controller.assembler
        )
        controller.resume(history, action, target)
        self._active = number

    def _command(self, quat: Array, t: float) -> tuple[NDArray[np.float32], float]:
        ranges = self._ranges(self._active)
        size = len(ranges)
        if len(self._state.value) != size:
            value = resized(self._state.value, size)
            self._state = CommandState(np.asarray(value, np.float64), self._state.t_s)
        frame = self._source.poll(t)
        if size == 0:
            return np.zeros(0, np.float32), 0.0
        self._state, age_s = command_step(self._state, frame, t, ranges)
        command = self._state.value.astype(np.float32)
        if self._hold is not None and size == _YAW + 1 and np.isfinite(quat).all():
            v_quat = self._controllers[self._active].bundle.manifest.interface.v_quat_b
            yaw = heading(multiply(quat, v_quat))
            self._reference, rate = heading_step(
                self._reference, yaw, float(command[_YAW]), self._hold
            )
            command[_YAW] = rate
        return command, age_s

    def _ranges(self, number: int) -> tuple[tuple[float, float], ...]:
        return self._controllers[number].bundle.manifest.interface.command_ranges

    def _run(
        self, packet: np.void, command: NDArray[np.float32]
    ) -> tuple[Array, PolicyFault]:
        controller = self._controllers[self._active]
        down = gravity(packet["quat"])
        step = controller.step(packet["pos"], down, packet["gyro"], command)
        target = step.astype(np.float64)
        if controller.faults:
            bad = controller.fault == "non-finite measurement"
            return target, PolicyFault.OBSERVATION if bad else PolicyFault.OUTPUT
        asked = asked_for(controller.action, controller.bundle.manifest.interface)
        self._keep(packet, command, asked)
        return target, PolicyFault.NONE

    def _keep(self, packet: np.void, command: NDArray, asked_rad: Array) -> None:
        down = gravity(packet["quat"])
        self._moments.append(
            Moment(packet["pos"], down, packet["gyro"], command, asked_rad)
        )

    def _look_for_upright(self, packet: np.void, target: Array, t: float) -> None:
        """Recovery is over once the hand is upright: settle, then the first policy."""
        manifest = self._controllers[self._active].bundle.manifest
        if manifest.task != RECOVERY:
            return
        tilt = tilt_angle(packet["quat"], manifest.interface.v_quat_b)
        speed = float(np.linalg.norm(packet["gyro"]))
        self._upright_s, upright = upright_step(self._upright_s, tilt, speed, t)
        if upright:
            goal = self._controllers[0].bundle.manifest.interface.initial_target_rad
            self._ramp = settle_ramp(t, target, goal, manifest.interface)

    def _follow_ramp(self, packet: np.void, command: NDArray, t: float) -> Array:
        ramp = self._ramp
        assert ramp is not None
        target = ramp.target(t)
        self._keep(packet, command, target - packet["target"])
        if ramp.over(t) and self._active != 0:
            self._ramp, self._upright_s = None, np.inf
            self._hand_over(0, target)
        return target
