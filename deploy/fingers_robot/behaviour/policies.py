"""The policy's side of the link: which policy runs, with which inputs.

    operator selects ──► policy ──(recovery, upright)──► settle ramp ──► first policy
        │                  └── a recovery that begins upright: settle ramp at once
        └── another stance ──► stand ──► ramp to the own one, to that ──► policy

A recovery policy that is the first itself goes on holding the stance after the ramp.
While the supervisor does not let the policy run, every policy starts afresh at the
targets on the wire.
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from fingers_deploy.controller import PolicyController
from fingers_deploy.manifest import Interface
from fingers_deploy.rotations import gravity
from fingers_robot.behaviour.exchange import Answer, Query, padded, propose
from fingers_robot.behaviour.hand_over import Moment, asked_for, build_history
from fingers_robot.behaviour.settle import Ramp, settle_ramp
from fingers_robot.behaviour.sources import Sources, SourceSample
from fingers_robot.behaviour.task_inputs import inputs_of
from fingers_robot.behaviour.upright import tilt_angle, upright_step
from fingers_robot.reading import Array
from fingers_robot.safety.types import PolicyFault

RECOVERY = "recovery"
SAME_STANCE_RAD = 0.02
STAND_S = 1.0
"""Time without a command before a ramp to another stance: a hand that is stopped in the
middle of a stride may fall over, one that stands does not."""


class Policies:
    """One or more policies and the sources of their inputs.

    Args:
        controllers: the policies; the first is the one to which recovery leads.
        sources: of commands, keys and camera samples.
    """

    def __init__(self, controllers: tuple[PolicyController, ...], sources: Sources):
        self._controllers, self.sources = controllers, sources
        longest = max(
            term.history
            for c in controllers
            for term in c.bundle.manifest.interface.observation.terms
        )
        self._moments: deque[Moment] = deque(maxlen=longest + 1)
        self._active = self._selected = 0
        self._ramp: Ramp | None = None
        self._stances: tuple[int, ...] = ()
        self._then: int | None = None
        self._held = self._getting_up = False
        self._stood_s = self._upright_s = np.inf

    @property
    def active(self) -> int:
        """Number of the policy that runs."""
        return self._active

    @property
    def settling(self) -> bool:
        """Whether a ramp moves the targets, or holds them where it ended."""
        return self._ramp is not None

    def finish(self) -> tuple[str, ...]:
        """Lets go of the sources; returns what the operator should know of them."""
        return self.sources.finish()

    def answer(self, query: Query) -> Answer:
        """Answers one query of the supervisor."""
        t, target = query.t_s, query.target_rad
        if not query.runs:
            self._rest(query)
        elif query.policy != self._selected:
            self._select(query.policy, target, t)
        interface = self._interface(self._active)
        sample = self.sources.poll(query, interface, self._stood_s < np.inf)
        inputs = inputs_of(interface, sample.given, query.joint_pos)
        fault = PolicyFault.NONE
        if query.runs:
            self._spare_recovery(query, target, t)
        if query.runs and self._ramp is not None:
            target = self._follow_ramp(self._ramp, query, sample, t)
        elif query.runs and not sample.moves:
            self._held = True
            self._keep(query, sample, np.zeros(len(target)))
        elif query.runs:
            target, fault = self._run(query, sample, inputs)
            self._look_for_upright(query, target, t)
        if query.runs and t >= self._stood_s:
            # By its own stance, from which the way to the other one is tested.
            self._settle((self._active, self._selected), target, t)
            self._stood_s, self._then = np.inf, self._selected
        proposal = propose(query, target, sample.age_s, fault)
        return Answer(proposal, padded(inputs), self._active)

    def _rest(self, query: Query) -> None:
        """Everything starts afresh at the targets on the wire."""
        self._moments.clear()
        self.sources.rest()
        self._ramp, self._held, self._getting_up = None, False, False
        self._stood_s = self._upright_s = np.inf
        selected = query.policy
        if 0 <= selected < len(self._controllers):
            self._active = self._selected = selected
        if np.isfinite(query.target_rad).all():
            self._controllers[self._active].reset(query.target_rad)

    def _select(self, number: int, target: Array, t: float) -> None:
        """Goes to another policy, by a ramp where it stands in another way."""
        if not 0 <= number < len(self._controllers):
            return
        self._selected = number
        self._stood_s = self._upright_s = np.inf
        stances = [
            np.asarray(self._interface(k).initial_target_rad)
            for k in (self._active, number)
        ]
        apart = np.abs(stances[1] - stances[0]).max()
        if self._ramp is None and apart <= SAME_STANCE_RAD:
            self._hand_over(number, target)
        elif self._ramp is None:
            self._stood_s = t + STAND_S
        else:
            self._settle((self._active, number), target, t)
            self._then = number

    def _settle(self, stances: tuple[int, ...], target: Array, t: float) -> None:
        """Begins the ramp to the first of these policies' stances."""
        goal = self._interface(stances[0]).initial_target_rad
        # The supervisor allows each policy its own α: a ramp keeps to the smallest.
        interfaces = (c.bundle.manifest.interface for c in self._controllers)
        slowest = min(interfaces, key=lambda interface: interface.action.scale_rad)
        self._ramp = settle_ramp(t, target, goal, slowest)
        self._stances = stances[1:]

    def _hand_over(self, number: int, target: Array) -> None:
        controller = self._controllers[number]
        history, action = build_history(
            tuple(self._moments), self._interface(number), controller.assembler
        )
        controller.resume(history, action, target)
        self._active, self._held, self._getting_up = number, False, False

    def _interface(self, number: int) -> Interface:
        return self._controllers[number].bundle.manifest.interface

    def _run(
        self, query: Query, sample: SourceSample, inputs: NDArray[np.float32]
    ) -> tuple[Array, PolicyFault]:
        if self._held:
            self._hand_over(self._active, query.target_rad)
        controller = self._controllers[self._active]
        down = gravity(query.quat_w)
        step = controller.step(query.joint_pos, down, query.gyro_b, inputs)
        target = step.astype(np.float64)
        if controller.faults:
            bad = controller.fault == "non-finite measurement"
            return target, PolicyFault.OBSERVATION if bad else PolicyFault.OUTPUT
        asked = asked_for(controller.action, self._interface(self._active))
        self._keep(query, sample, asked)
        return target, PolicyFault.NONE

    def _keep(self, query: Query, sample: SourceSample, asked_rad: Array) -> None:
        down = gravity(query.quat_w)
        self._moments.append(
            Moment(query.joint_pos, down, query.gyro_b, sample.given, asked_rad)
        )

    def _spare_recovery(self, query: Query, target: Array, t: float) -> None:
        """A hand that stands as a recovery begins is not thrown over: it settles."""
        if not self._recovers() or self._getting_up or self._ramp is not None:
            return
        since_s, _ = self._upright(np.inf, query, t)
        self._getting_up = since_s == np.inf
        if not self._getting_up:
            self._end_recovery(target, t)

    def _look_for_upright(self, query: Query, target: Array, t: float) -> None:
        """Recovery is over once the hand is upright: settle, then the first policy."""
        if not self._recovers():
            return
        self._upright_s, upright = self._upright(self._upright_s, query, t)
        if upright:
            self._end_recovery(target, t)

    def _recovers(self) -> bool:
        manifest = self._controllers[self._active].bundle.manifest
        return manifest.task == RECOVERY and self._stood_s == np.inf

    def _upright(self, since_s: float, query: Query, t: float) -> tuple[float, bool]:
        tilt = tilt_angle(query.quat_w, self._interface(self._active).v_quat_b)
        speed = float(np.linalg.norm(query.gyro_b))
        return upright_step(since_s, tilt, speed, t)

    def _end_recovery(self, target: Array, t: float) -> None:
        self._settle((0,), target, t)
        self._then = 0 if self._active != 0 else None

    def _follow_ramp(
        self, ramp: Ramp, query: Query, sample: SourceSample, t: float
    ) -> Array:
        target = ramp.target(t)
        self._keep(query, sample, target - query.target_rad)
        if ramp.over(t) and self._stances:
            self._settle(self._stances, target, t)
        elif ramp.over(t) and self._then is not None:
            self._ramp, self._upright_s = None, np.inf
            self._hand_over(self._then, target)
        return target
