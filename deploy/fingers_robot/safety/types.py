"""Modes, reactions, and what goes into and comes out of the supervisor."""

import enum
from dataclasses import dataclass

from fingers_robot.reading import Array, Health, ImuReading, Reading

Found = dict[str, str]
"""What a step found: row of the table, and what it is in words."""


class Mode(enum.IntEnum):
    """Modes of the supervisor.

    DISABLED: de-energized, nothing is wrong that it knows of, may be armed.
    ARMING: energized under the supervisor's own targets.
    ACTIVE: the policy's targets pass.
    STOPPING: energized, a fault is latched: holding, or settling and then disabling.
    SAFE: de-energized; a fault or a stop is latched until the operator clears it.
    """

    DISABLED = 0
    ARMING = 1
    ACTIVE = 2
    STOPPING = 3
    SAFE = 4


class Reaction(enum.IntEnum):
    """What a fault calls for; the most severe wins."""

    NONE = 0
    HOLD = 1
    SETTLE = 2
    DISABLE = 3


class Operator(enum.IntEnum):
    """An explicit action of the operator; nothing else arms or clears.

    STOP settles, then de-energizes; OFF de-energizes at once.
    """

    NONE = 0
    ARM = 1
    STOP = 2
    CLEAR = 3
    OFF = 4


class PolicyFault(enum.IntEnum):
    """What the policy process says of its own step."""

    NONE = 0
    OBSERVATION = 1
    OUTPUT = 2


@dataclass(frozen=True, slots=True)
class Proposal:
    """The policy's answer to one observation.

    Attributes:
        tick: number of the control step that it answers, for the log.
        response: complement of that step's challenge.
        target_rad: proposed joint targets; of any length, as received.
        command_age_s: age of the command source's newest frame [s].
        fault: what the policy process found wrong.
    """

    tick: int
    response: int
    target_rad: Array
    command_age_s: float = 0.0
    fault: PolicyFault = PolicyFault.NONE


@dataclass(frozen=True, slots=True)
class Inputs:
    """Everything that one step of the supervisor looks at.

    Attributes:
        reading: newest sample of the joints; None before the first.
        imu: newest sample of the IMU.
        health: newest slow read-back.
        proposal: an answer of the policy that arrived since the step before.
        link_open: the policy process holds its end of the link.
        operator: action of the operator since the step before.
        preflight_ok: every check of the preflight holds now.
        driver_error: what the driver raised; empty if nothing.
        skipped_ticks: control steps skipped in a row before this one.
        control_tick: number of the control step that begins now, −1 if none does.
    """

    reading: Reading | None = None
    imu: ImuReading | None = None
    health: Health | None = None
    proposal: Proposal | None = None
    link_open: bool = True
    operator: Operator = Operator.NONE
    preflight_ok: bool = False
    driver_error: str = ""
    skipped_ticks: int = 0
    control_tick: int = -1


@dataclass(frozen=True, slots=True)
class Outputs:
    """What one step of the supervisor asks for.

    Attributes:
        target_rad: targets to write now; None: write nothing.
        enable: energize (True), de-energize (False), or leave as it is (None).
        challenge: number whose complement renews the lease.
        policy_runs: the policy's targets pass; else it starts afresh at `target`.
        alarm: de-energizing was not confirmed: cut the battery.
        events: lines for the log, in plain words.
    """

    target_rad: Array | None
    enable: bool | None
    challenge: int
    policy_runs: bool
    alarm: bool = False
    events: tuple[str, ...] = ()
