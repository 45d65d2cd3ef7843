"""The safety table: what counts as a fault, how fast, what then, and who may clear it.

Each row is one fault. The rule is computed by a function of `detect_*.py`; the row says
what follows. A latched fault stays until the operator clears it; while several are
latched, the most severe reaction holds.
"""

from dataclasses import dataclass

from fingers_robot.safety.types import Reaction

HOLD, SETTLE, DISABLE = Reaction.HOLD, Reaction.SETTLE, Reaction.DISABLE


@dataclass(frozen=True, slots=True)
class Row:
    """One fault of the table.

    Attributes:
        id: its number.
        name: its name in logs.
        rule: the detection rule, in words.
        within_s: longest time from the fault to the command on the wire [s].
        reaction: what follows at once.
        worse: a more severe reaction that follows, or None.
        after_s: how long after the first reaction `worse` follows [s].
        lasting: `worse` follows only if the fault is still there then.
        clear: who may clear it, and when.
    """

    id: str
    name: str
    rule: str
    within_s: float
    reaction: Reaction
    worse: Reaction | None = None
    after_s: float = 0.0
    lasting: bool = True
    clear: str = "operator, once it is gone"


ROWS = (
    Row(
        "S1",
        "late observation",
        "newest joint or IMU sample older than 40 ms",
        0.060,
        HOLD,
        DISABLE,
        0.44,
    ),
    Row(
        "S2",
        "frozen sensor",
        "20 joints bit-identical for 100 ms while a target moves by 0.02 rad; those of "
        "one finger while its own targets move by 0.1 rad; IMU bit-identical for 60 ms",
        0.150,
        HOLD,
        DISABLE,
        0.40,
    ),
    Row(
        "S2b",
        "slow read-back lost",
        "newest health read-back older than 380 ms",
        0.400,
        HOLD,
        DISABLE,
        0.12,
    ),
    Row(
        "S3",
        "bad observation",
        "NaN, infinity or an impossible value in a measurement or observation",
        0.020,
        HOLD,
        DISABLE,
        0.040,
    ),
    Row(
        "S4",
        "bad target",
        "policy output not finite, step larger than alpha, or outside the trained "
        "limits by more than 0.02 rad (and targets pass once per control step, with "
        "the answer that renews the lease)",
        0.020,
        HOLD,
        DISABLE,
        0.040,
    ),
    Row(
        "S5",
        "over-current",
        "a joint above 1.05 of the effort limit for 20 ms, or above 0.9 of it for 1 s",
        0.050,
        HOLD,
        DISABLE,
        0.10,
        lasting=False,
    ),
    Row(
        "S6",
        "unhealthy hand",
        "effort limit read back differs, joint at 80 °C or more, supply out of range, "
        "or an error bit",
        0.600,
        SETTLE,
    ),
    Row(
        "S7",
        "over-tilt",
        "roll or pitch of V beyond the task's limit for 100 ms (recovery: 10 s)",
        0.150,
        HOLD,
        DISABLE,
        0.50,
        lasting=False,
    ),
    Row(
        "S8",
        "joint limit",
        "a joint outside its factory limits by more than 0.05 rad (recovery: 0.15)",
        0.060,
        HOLD,
    ),
    Row(
        "S8b",
        "tracking error",
        "target and joint differ by more than 0.5 rad for 0.5 s",
        0.560,
        HOLD,
    ),
    Row(
        "S10",
        "command lost",
        "newest frame of the gamepad or, for a policy that reads it, sample of the "
        "camera older than 1 s (from 250 ms on the command goes to zero), or the "
        "keyboard that is pressed unplugged",
        1.060,
        SETTLE,
    ),
    Row(
        "S11",
        "lease missed",
        "no valid answer of the policy to a challenge of the last 60 ms",
        0.100,
        HOLD,
        DISABLE,
        0.44,
    ),
    Row(
        "S12",
        "policy process gone",
        "the policy's end of the link is closed",
        0.100,
        HOLD,
        SETTLE,
        0.10,
        lasting=False,
    ),
    Row(
        "S15",
        "driver exception",
        "the driver raised anything",
        0.100,
        DISABLE,
    ),
    Row(
        "S17",
        "wiggle failed",
        "while arming: a joint that was moved did not follow, or another one did",
        0.060,
        DISABLE,
    ),
    Row(
        "S18",
        "partial command",
        "a proposal with another number of joints",
        0.020,
        HOLD,
    ),
    Row(
        "S20",
        "unsafe start",
        "while arming: energizing not confirmed in 1 s, or fast and slow joint angles "
        "differ by more than 0.05 rad",
        0.060,
        DISABLE,
    ),
    Row(
        "L3",
        "loop overrun",
        "more than 3 control steps skipped in a row, or 100 ms without a step",
        0.100,
        HOLD,
    ),
    Row(
        "L7",
        "clock jump",
        "the monotonic clock went backwards",
        0.020,
        DISABLE,
    ),
    Row(
        "OP",
        "operator stop",
        "the operator asked for it, or the console is gone",
        0.060,
        SETTLE,
        clear="operator",
    ),
)
BY_ID = {row.id: row for row in ROWS}
