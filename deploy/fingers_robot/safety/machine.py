"""The supervisor: a pure function from state, inputs and time to state and outputs.

    disabled ──arm──► arming ──armed──► active
        ▲               │ trip            │ trip
        │               ▼                 ▼
      clear ◄── safe ◄── settled / disable ── stopping

Nothing arms or clears by itself; the severity of a stop only grows.
"""

import dataclasses
import enum
from dataclasses import dataclass, field

import numpy as np

from fingers_robot.reading import Array
from fingers_robot.safety.arming import ALL_JOINTS, Arming, start_arming, step_arming
from fingers_robot.safety.detectors.body import detect_tilt
from fingers_robot.safety.detectors.health import detect_health
from fingers_robot.safety.detectors.joints import (
    JointMemory,
    believable,
    detect_joints,
)
from fingers_robot.safety.detectors.loop import detect_loop
from fingers_robot.safety.detectors.policy import (
    LeaseMemory,
    detect_policy,
    renew_lease,
    steps_behind,
)
from fingers_robot.safety.detectors.sensors import SensorMemory, detect_sensors
from fingers_robot.safety.latch import Fault, latch, severest
from fingers_robot.safety.limits import Limits
from fingers_robot.safety.motion import toward
from fingers_robot.safety.stopping import Stop, start_stop, step_stop
from fingers_robot.safety.types import Inputs, Mode, Operator, Outputs, Reaction

ENERGIZED = (Mode.ARMING, Mode.ACTIVE, Mode.STOPPING)
CONFIRM_TRIES = 4


class Event(enum.IntEnum):
    """What can change the mode, most urgent first."""

    TRIP_DISABLE = 0
    TRIP_STOP = 1
    SETTLED = 2
    ARMED = 3
    ARM = 4
    CLEAR = 5


TRANSITIONS: dict[tuple[Mode, Event], Mode] = {
    (Mode.DISABLED, Event.ARM): Mode.ARMING,
    (Mode.ARMING, Event.TRIP_DISABLE): Mode.SAFE,
    (Mode.ARMING, Event.TRIP_STOP): Mode.STOPPING,
    (Mode.ARMING, Event.ARMED): Mode.ACTIVE,
    (Mode.ACTIVE, Event.TRIP_DISABLE): Mode.SAFE,
    (Mode.ACTIVE, Event.TRIP_STOP): Mode.STOPPING,
    (Mode.STOPPING, Event.TRIP_DISABLE): Mode.SAFE,
    (Mode.STOPPING, Event.SETTLED): Mode.SAFE,
    (Mode.SAFE, Event.CLEAR): Mode.DISABLED,
}
"""Every pair that is not here leaves the mode as it is."""


@dataclass(frozen=True, slots=True)
class State:
    """The supervisor's whole memory.

    Attributes:
        mode: the mode.
        since_s: when it was entered [s].
        t_s: time of the step before [s]; None before the first.
        target_rad: the targets on the wire; while de-energized the measured pose, [20].
        pose_rad: last valid measured angle of each joint, [20].
        goal_rad: newest targets of the policy that may pass, [20]; None in other modes.
        faults: the latched faults.
        sensors, joints, lease, tilt_since_s: memories of the detectors.
        arming: where arming stands; None in other modes.
        stop: where stopping stands; None in other modes.
        tries: how often de-energizing has been asked for since SAFE was entered.
        confirmed: the hand has confirmed that it is de-energized.
        wiggle: joints that arming wiggles.
    """

    mode: Mode
    since_s: float
    t_s: float | None
    target_rad: Array
    pose_rad: Array
    goal_rad: Array | None = None
    faults: tuple[Fault, ...] = ()
    sensors: SensorMemory = field(default_factory=SensorMemory)
    joints: JointMemory = field(default_factory=JointMemory)
    lease: LeaseMemory = field(default_factory=LeaseMemory)
    tilt_since_s: float = np.inf
    arming: Arming | None = None
    stop: Stop | None = None
    tries: int = 0
    confirmed: bool = True
    wiggle: tuple[int, ...] = ALL_JOINTS


def initial_state(
    limits: Limits, t: float, wiggle: tuple[int, ...] = ALL_JOINTS
) -> State:
    """De-energized and without faults."""
    rest = limits.rest_rad
    return State(Mode.DISABLED, t, None, rest, rest, wiggle=wiggle)


def step(
    state: State, inputs: Inputs, t: float, limits: Limits
) -> tuple[State, Outputs]:
    """One step of the supervisor; pure, total over all inputs.

    Args:
        state: state after the step before.
        inputs: everything that is known now.
        t: monotonic time [s].
        limits: the limits.

    Returns:
        The new state, and what to do.
    """
    state, found = _detect(state, inputs, t, limits)
    state, found, armed = _advance_arming(state, inputs, found, t, limits)
    state, lines = _latch(state, inputs, found, t)
    state, settled = _advance_stop(state, t, limits)
    events = _events(state, inputs, found, armed, settled)
    event = min((e for e in events if (state.mode, e) in TRANSITIONS), default=None)
    if event is not None:
        after = TRANSITIONS[state.mode, event]
        lines += (f"{state.mode.name.lower()} -> {after.name.lower()}",)
        state = _enter(state, after, t, limits)
    elif inputs.operator in (Operator.ARM, Operator.CLEAR):
        lines += (_refusal(state, inputs, found),)
    state = _targets(state, inputs, limits)
    return _finish(state, inputs, t, limits, lines)


def _detect(
    state: State, inputs: Inputs, t: float, limits: Limits
) -> tuple[State, dict[str, str]]:
    target = state.target_rad
    lease = renew_lease(state.lease, inputs, t)
    sensors, found = detect_sensors(state.sensors, inputs, target, t, limits)
    joints, more = detect_joints(state.joints, inputs, target, t, limits)
    tilt_since, tilted = np.inf, {}
    # A recovery is armed on its side; its time to get up begins when it runs.
    if state.mode == Mode.ACTIVE or not limits.begins_at_pose:
        tilt_since, tilted = detect_tilt(state.tilt_since_s, inputs, t, limits)
    found |= more | tilted
    found |= detect_policy(lease, inputs, target, t, limits)
    found |= detect_health(inputs, t, limits)
    found |= detect_loop(t if state.t_s is None else state.t_s, inputs, t, limits)
    pose = state.pose_rad
    if inputs.reading is not None:
        pos = inputs.reading.pos_rad
        # A joint that cannot be where it says is held where it last could be.
        pose = np.where(believable(pos, limits), pos, pose)
    state = dataclasses.replace(
        state,
        t_s=t,
        pose_rad=pose,
        sensors=sensors,
        joints=joints,
        lease=lease,
        tilt_since_s=tilt_since,
    )
    return state, found


def _advance_arming(
    state: State, inputs: Inputs, found: dict[str, str], t: float, limits: Limits
) -> tuple[State, dict[str, str], bool]:
    if state.arming is None:
        return state, found, False
    progress = step_arming(state.arming, inputs, t, limits)
    state = dataclasses.replace(
        state, arming=progress.arming, target_rad=progress.target_rad
    )
    return state, found | progress.found, progress.done


def _latch(
    state: State, inputs: Inputs, found: dict[str, str], t: float
) -> tuple[State, tuple[str, ...]]:
    if state.mode not in ENERGIZED:
        return state, ()
    asked = {Operator.STOP: "OP", Operator.OFF: "OFF"}.get(inputs.operator)
    if asked is not None:
        found = found | {asked: "asked for"}
    faults, lines = latch(state.faults, found, t)
    return dataclasses.replace(state, faults=faults), lines


def _advance_stop(state: State, t: float, limits: Limits) -> tuple[State, bool]:
    if state.stop is None:
        return state, False
    stop, target, settled = step_stop(
        state.stop, state.target_rad, severest(state.faults), t, limits
    )
    return dataclasses.replace(state, stop=stop, target_rad=target), settled


def _events(
    state: State, inputs: Inputs, found: dict[str, str], armed: bool, settled: bool
) -> set[Event]:
    reaction = severest(state.faults)
    well = not found
    happened = {
        Event.TRIP_DISABLE: reaction == Reaction.DISABLE,
        Event.TRIP_STOP: reaction in (Reaction.HOLD, Reaction.SETTLE),
        Event.SETTLED: settled,
        Event.ARMED: armed,
        Event.ARM: inputs.operator == Operator.ARM and inputs.preflight_ok and well,
        Event.CLEAR: inputs.operator == Operator.CLEAR and state.confirmed and well,
    }
    return {event for event, holds in happened.items() if holds}


def _enter(state: State, mode: Mode, t: float, limits: Limits) -> State:
    changes: dict = {"mode": mode, "since_s": t, "arming": None, "stop": None}
    if mode == Mode.DISABLED:
        changes["faults"] = ()
    if mode == Mode.ARMING:
        pose = state.pose_rad
        changes["target_rad"] = pose
        changes["arming"] = start_arming(pose, t, limits, state.wiggle)
    if mode == Mode.STOPPING:
        low, high = limits.allowed_rad[:, 0], limits.allowed_rad[:, 1]
        changes["stop"] = start_stop(np.clip(state.pose_rad, low, high), t)
    if mode == Mode.SAFE:
        changes |= {"tries": 0, "confirmed": False}
    return dataclasses.replace(state, **changes)


def _targets(state: State, inputs: Inputs, limits: Limits) -> State:
    """Passes the policy's target, or follows the measured pose while de-energized."""
    if state.mode not in ENERGIZED:
        return dataclasses.replace(state, target_rad=state.pose_rad, goal_rad=None)
    if state.mode != Mode.ACTIVE:
        return dataclasses.replace(state, goal_rad=None)
    lease, goal = state.lease, state.goal_rad
    if lease.fresh and inputs.proposal is not None:
        low, high = limits.allowed_rad[:, 0], limits.allowed_rad[:, 1]
        goal = np.clip(inputs.proposal.target_rad, low, high)
    if goal is None or not (lease.fresh or lease.tick < lease.answered):
        return state
    tick = lease.answered - steps_behind(goal - state.target_rad, limits)
    return dataclasses.replace(
        state,
        target_rad=toward(state.target_rad, goal, limits.step_rad),
        goal_rad=goal,
        lease=dataclasses.replace(lease, tick=tick),
    )


def _finish(
    state: State, inputs: Inputs, t: float, limits: Limits, lines: tuple[str, ...]
) -> tuple[State, Outputs]:
    """Asks for power, confirms that it is off, and makes the outputs."""
    enable, alarm = None, False
    if state.mode == Mode.ARMING and state.arming is not None:
        enable = True if state.arming.phase == 0 else None
    if state.mode == Mode.SAFE and not state.confirmed:
        health = inputs.health
        if health is not None and health.disabled and health.t_s > state.since_s:
            state = dataclasses.replace(state, confirmed=True)
            lines += ("de-energized, confirmed by the hand",)
        elif t - state.since_s >= state.tries * limits.confirm_s:
            state = dataclasses.replace(state, tries=state.tries + 1)
            enable = False
            alarm = state.tries > CONFIRM_TRIES
            if alarm:
                lines += ("NOT CONFIRMED de-energized: cut the battery",)
    target = state.target_rad if state.mode in ENERGIZED else None
    runs = state.mode == Mode.ACTIVE
    return state, Outputs(target, enable, state.lease.challenge, runs, alarm, lines)


def _refusal(state: State, inputs: Inputs, found: dict[str, str]) -> str:
    asked = inputs.operator.name.lower()
    if found:
        name, detail = next(iter(found.items()))
        return f"{asked} refused: {name} {detail}"
    if inputs.operator == Operator.ARM and state.mode == Mode.DISABLED:
        return "arm refused: the preflight does not pass"
    return f"{asked} refused in mode {state.mode.name.lower()}"
