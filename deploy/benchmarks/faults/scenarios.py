"""Faults, by row of the safety table."""

from dataclasses import dataclass

from faults import install as i
from faults.install import Install

from fingers_robot.reading import Health, ImuReading, Reading
from fingers_robot.safety import Mode


@dataclass(frozen=True)
class Scenario:
    """One fault.

    Attributes:
        row: row of the table that must be latched first.
        name: what happens.
        install: puts it into a lab.
        within_s: longest time to the reaction on the wire.
        ends: mode in which it must end.
        ends_s: time by which it must be there [s].
    """

    row: str
    name: str
    install: Install
    within_s: float
    ends: Mode
    ends_s: float


_HOLDING, _SAFE = Mode.STOPPING, Mode.SAFE
_BAD_ANGLE = i.one_entry(Reading, "pos_rad", i.bad_number)
_BAD_GYRO = i.one_entry(ImuReading, "gyro_b", i.bad_number)
_OVER_CURRENT = i.one_entry(Reading, "effort_a", lambda r: r.uniform(1.06, 3.0))
_STALL = i.one_entry(Reading, "effort_a", lambda r: r.uniform(0.92, 1.0))
_EFFORT_LIMIT = i.health("effort_limit_a", lambda r: 1.5)
_HOT = i.health("temperature_c", lambda r: r.uniform(80, 99))

SCENARIOS = tuple(
    Scenario(*row)
    for row in (
        ("S1", "late joints", i.samples(Reading, i.late), 0.060, _SAFE, 0.52),
        ("S1", "late IMU", i.samples(ImuReading, i.late), 0.060, _SAFE, 0.52),
        ("S2", "frozen joints", i.frozen(Reading), 0.150, _SAFE, 0.60),
        ("S2", "frozen IMU", i.frozen(ImuReading), 0.150, _SAFE, 0.60),
        ("S2b", "slow path silent", i.samples(Health, i.late), 0.400, _SAFE, 0.60),
        ("S3", "bad angle", _BAD_ANGLE, 0.020, _SAFE, 0.10),
        ("S3", "bad gyro", _BAD_GYRO, 0.020, _SAFE, 0.10),
        ("S3", "flapping NaN", i.flapping, 0.020 + 0.5, _SAFE, 1.6),
        ("S4", "bad target", i.proposals(i.nan_target), 0.041, _SAFE, 0.12),
        ("S4", "far target", i.proposals(i.far_target), 0.041, _SAFE, 0.12),
        ("S4", "network gives NaN", i.broken_network, 0.041, _HOLDING, 0.3),
        ("S5", "over-current", _OVER_CURRENT, 0.050, _SAFE, 0.20),
        ("S5", "stall", _STALL, 1.050, _SAFE, 1.2),
        ("S6", "effort limit changed", _EFFORT_LIMIT, 0.600, _SAFE, 2.4),
        ("S6", "joint hot", _HOT, 0.600, _SAFE, 2.4),
        ("S6", "error bit", i.error_bit, 0.600, _SAFE, 2.4),
        ("S7", "toppled", i.toppled, 0.250, _SAFE, 0.9),
        ("S8", "joint outside", i.outside, 0.060, _HOLDING, 1.0),
        ("S8b", "finger caught", i.blocked, 0.560, _HOLDING, 1.0),
        ("S10", "gamepad lost", i.gamepad_lost, 1.060, _SAFE, 3.0),
        ("S11", "policy hangs", i.hang, 0.100, _SAFE, 0.56),
        ("S11", "wrong answers", i.proposals(i.wrong_answers), 0.100, _SAFE, 0.56),
        ("S12", "policy killed", i.killed, 0.100, _SAFE, 2.0),
        ("S15", "unplugged", i.raises, 0.100, _SAFE, 0.1),
        ("S15", "write fails", i.write_raises, 0.100, _SAFE, 0.1),
        ("S18", "partial command", i.proposals(i.partial), 0.041, _HOLDING, 1.0),
        ("S19", "two at once", i.two_at_once, 0.600, _SAFE, 2.4),
        ("S19", "while settling", i.while_settling, 0.100, _SAFE, 0.2),
        ("L3", "supervisor away", i.slow_driver, 0.100, _HOLDING, 0.3),
        ("L7", "clock back", i.clock_back, 0.020, _SAFE, 0.1),
    )
)
"""S9, S13, S17, S20: `links`, `processes`, `startup`; S16: `fuzz_bundles`."""
