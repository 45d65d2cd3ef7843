"""S2b slow read-back lost, S6 unhealthy hand, S15 driver exception."""

import numpy as np

from fingers_robot.reading import Health
from fingers_robot.safety.limits import Limits
from fingers_robot.safety.types import Found, Inputs

EFFORT_TOLERANCE_A = 0.01

ERROR_BITS = {
    0: "ADC",
    1: "driver communication",
    2: "driver fault",
    3: "encoder 1 communication",
    4: "encoder 1 noise",
    5: "bus over-voltage",
    6: "bus under-voltage",
    7: "transmission slip",
    8: "phase over-current",
    13: "over-temperature",
    14: "board information",
    16: "encoder 2 communication",
    17: "encoder 2 noise",
    18: "flash",
    19: "flash",
    20: "flash",
    21: "user configuration",
    22: "flash writes",
}
"""Meaning of the error bits of wujihandpy 1.8 (hand generation 1)."""


def detect_health(inputs: Inputs, t: float, limits: Limits) -> Found:
    """Looks at the slow read-back and at what the driver raised."""
    found: Found = {}
    if inputs.driver_error:
        found["S15"] = inputs.driver_error
    health = inputs.health
    if health is None:
        found["S2b"] = "no slow read-back yet"
        return found
    if t - health.t_s > limits.health_age_s:
        found["S2b"] = f"slow read-back {1e3 * (t - health.t_s):.0f} ms old"
    problems = unhealthy(health, limits)
    if problems:
        found["S6"] = problems[0]
    return found


def unhealthy(health: Health, limits: Limits) -> list[str]:
    """Everything in a slow read-back that forbids to go on, in words."""
    problems = []
    low, high = limits.bus_v
    # Written so that NaN is a problem as well.
    if not low <= health.bus_v <= high:
        problems.append(f"supply at {health.bus_v:.1f} V, valid {low:g} to {high:g} V")
    hottest = int(np.argmax(health.temperature_c))
    if not health.temperature_c[hottest] < limits.max_temperature_c:
        problems.append(f"joint {hottest} at {health.temperature_c[hottest]:.0f} °C")
    off = np.abs(health.effort_limit_a - limits.effort_limit_a)
    if not off.max() <= EFFORT_TOLERANCE_A:
        joint = int(off.argmax())
        limit = health.effort_limit_a[joint]
        problems.append(f"effort limit of joint {joint} is {limit:.2f} A")
    for joint in np.flatnonzero(health.error_code):
        words = error_words(int(health.error_code[joint]))
        problems.append(f"joint {joint} reports {words}")
    return problems


def error_words(code: int) -> str:
    """Names the bits of an error code."""
    bits = [i for i in range(32) if code >> i & 1]
    return ", ".join(ERROR_BITS.get(i, f"error bit {i}") for i in bits)
