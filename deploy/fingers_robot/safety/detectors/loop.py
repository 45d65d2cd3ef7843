"""L3 loop overrun, L7 clock jump."""

from fingers_robot.safety.limits import Limits
from fingers_robot.safety.types import Found, Inputs


def detect_loop(last_s: float, inputs: Inputs, t: float, limits: Limits) -> Found:
    """Looks at the time since the step before, at `last_s` [s]."""
    found: Found = {}
    if t < last_s:
        found["L7"] = f"the clock went back by {last_s - t:.3f} s"
    elif t - last_s > limits.gap_s:
        found["L3"] = f"{1e3 * (t - last_s):.0f} ms without a step"
    if inputs.skipped_ticks > limits.skipped_ticks:
        found["L3"] = f"{inputs.skipped_ticks} control steps skipped"
    return found
