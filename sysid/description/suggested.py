"""Effects that a record suggests, and that its simulation may have already."""

from collections.abc import Sequence

import numpy as np

from sysid.description.law import Law, enough, joined, rows_of
from sysid.description.stretches import Stretch

PLATEAU = 0.1
"""Relative spread of speeds that are one speed."""

APPROACHES = 0.02
"""Least share of rows that go fast to a target that stands, for a limit to show."""

STANDS_S = 0.05
"""Time in which a target did not change, so that the servo sets the pace [s]."""


def suggested_effects(stretches: Sequence[Stretch], law: Law | None) -> tuple[str, ...]:
    """Returns effects as lines of YAML, with a comment each.

    Args:
        stretches: of the joint.
        law: of its servo.
    """
    lines = []
    if law and law.delay_s > 0.0:
        lines.append(_line("transport_delay", "delay_s", law.delay_s, "targets late"))
    if law and np.isfinite(law.cutoff_hz):
        said = "targets behind a low-pass"
        lines.append(_line("lowpass_cutoff", "cutoff_hz", law.cutoff_hz, said))
    speed = _own_speed(stretches)
    if speed:
        said = "its own speed where the target stands"
        lines.append(_line("slew_limit", "speed_rad_s", speed, said))
    return tuple(lines)


def _line(effect: str, name: str, value: float, said: str) -> str:
    return f"{effect}: {{{name}: {{value: {value:.3g}, free: true}}}}  # {said}"


def _own_speed(stretches: Sequence[Stretch]) -> float:
    """The speed at which a servo goes to targets that stand; 0 if it has none.

    Without a limit the speed of an approach depends on how far the target is.
    """
    rows = rows_of(stretches)
    if not enough(rows):
        return 0.0
    speed = joined([np.abs(s.vel) for s in stretches], rows)
    still = joined([_stands(s) for s in stretches], rows)
    fast = speed[still & (speed > 0.5 * np.percentile(speed, 99))]
    if len(fast) < APPROACHES * len(speed):
        return 0.0
    low, middle, high = np.percentile(fast, [25, 50, 75])
    return float(middle) if high - low < PLATEAU * middle else 0.0


def _stands(stretch: Stretch) -> np.ndarray:
    """Where the target is what it was a moment ago."""
    then = np.interp(stretch.t_s - STANDS_S, stretch.sent_s, stretch.target)
    now = np.interp(stretch.t_s, stretch.sent_s, stretch.target)
    return np.abs(now - then) < 1e-6
