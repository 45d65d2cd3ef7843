"""The safety table: what counts as a fault, how fast, what then, and who may clear it.

Each row is one fault. The rule is computed by a function of `detectors`; the row says
what follows. A latched fault stays until the operator clears it; while several are
latched, the most severe reaction holds.
"""

from dataclasses import dataclass

from fingers_robot.safety.types import Reaction

HOLD, SETTLE, DISABLE = Reaction.HOLD, Reaction.SETTLE, Reaction.DISABLE


RULES = {
    "S1": "newest joint or IMU sample older than 40 ms",
    "S2": (
        "20 joints bit-identical for 100 ms while a target moves by 0.02 rad; those of "
        "one finger while its own targets move by 0.1 rad; IMU bit-identical for 60 ms"
    ),
    "S2b": "newest health read-back older than 380 ms",
    "S3": "NaN, infinity or an impossible value in a measurement or observation",
    "S4": (
        "policy output not finite, step larger than alpha, or outside the trained "
        "limits by more than 0.02 rad (and targets pass once per control step, with "
        "the answer that renews the lease)"
    ),
    "S5": (
        "a joint above 1.05 of the effort limit for 20 ms, or above 0.9 of it for 1 s"
    ),
    "S6": (
        "effort limit read back differs, joint at 80 °C or more, supply out of range, "
        "or an error bit"
    ),
    "S7": "roll or pitch of V beyond the task's limit for 100 ms (recovery: 10 s)",
    "S8": "a joint outside its factory limits by more than 0.05 rad (recovery: 0.15)",
    "S8b": "target and joint differ by more than 0.5 rad for 0.5 s",
    "S10": (
        "newest frame of the gamepad or, for a policy that reads it, sample of the "
        "camera older than 1 s (from 250 ms on the command goes to zero), or the "
        "keyboard that is pressed unplugged"
    ),
    "S11": "no valid answer of the policy to a challenge of the last 60 ms",
    "S12": "the policy's end of the link is closed",
    "S15": "the driver raised anything",
    "S17": "while arming: a joint that was moved did not follow, or another one did",
    "S18": "a proposal with another number of joints",
    "S20": (
        "while arming: energizing not confirmed in 1 s, or fast and slow joint angles "
        "differ by more than 0.05 rad"
    ),
    "L3": "more than 3 control steps skipped in a row, or 100 ms without a step",
    "L7": "the monotonic clock went backwards",
    "OP": "the operator asked for it, or the console or the guard is gone",
    "OFF": "the operator asked for it",
}
"""How each fault is found, in words, by row of the table."""


@dataclass(frozen=True, slots=True)
class Row:
    """One fault of the table.

    Attributes:
        id: its number.
        name: its name in logs.
        within_s: longest time from the fault to the command on the wire [s].
        reaction: what follows at once.
        worse: a more severe reaction that follows, or None.
        after_s: how long after the first reaction `worse` follows [s].
        lasting: `worse` follows only if the fault is still there then.
        clear: who may clear it, and when.
    """

    id: str
    name: str
    within_s: float
    reaction: Reaction
    worse: Reaction | None = None
    after_s: float = 0.0
    lasting: bool = True
    clear: str = "operator, once it is gone"

    @property
    def rule(self) -> str:
        """The detection rule, in words."""
        return RULES[self.id]


ROWS = (
    Row("S1", "late observation", 0.060, HOLD, DISABLE, 0.44),
    Row("S2", "frozen sensor", 0.150, HOLD, DISABLE, 0.40),
    Row("S2b", "slow read-back lost", 0.400, HOLD, DISABLE, 0.12),
    Row("S3", "bad observation", 0.020, HOLD, DISABLE, 0.04),
    Row("S4", "bad target", 0.020, HOLD, DISABLE, 0.04),
    Row("S5", "over-current", 0.050, HOLD, DISABLE, 0.10, lasting=False),
    Row("S6", "unhealthy hand", 0.600, SETTLE),
    Row("S7", "over-tilt", 0.150, HOLD, DISABLE, 0.50, lasting=False),
    Row("S8", "joint limit", 0.060, HOLD),
    Row("S8b", "tracking error", 0.560, HOLD),
    Row("S10", "command lost", 1.060, SETTLE),
    Row("S11", "lease missed", 0.100, HOLD, DISABLE, 0.44),
    Row("S12", "policy process gone", 0.100, HOLD, SETTLE, 0.10, lasting=False),
    Row("S15", "driver exception", 0.100, DISABLE),
    Row("S17", "wiggle failed", 0.060, DISABLE),
    Row("S18", "partial command", 0.020, HOLD),
    Row("S20", "unsafe start", 0.060, DISABLE),
    Row("L3", "loop overrun", 0.100, HOLD),
    Row("L7", "clock jump", 0.020, DISABLE),
    Row("OP", "operator stop", 0.060, SETTLE, clear="operator"),
    Row("OFF", "operator off", 0.060, DISABLE, clear="operator"),
)
BY_ID = {row.id: row for row in ROWS}
