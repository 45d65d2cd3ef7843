"""The lift objective as dials, in SVG: what each finger's average is, and when."""

import math
from collections.abc import Sequence

import numpy as np

from envs.hand.nominal import FINGERS
from fingers_mjx.play.viewer.colours import Rgb, hex_of
from fingers_mjx.play.viewer.view import Lifts
from rewards.lift import LiftParams

RADIUS = 26.0
"""Of the circle z_max [px]."""
BESIDE, HEIGHT = 62, 96


def dials(lifts: Lifts | None, colours: Sequence[Rgb]) -> str:
    """Returns the dials as HTML.

    A finger's hand is its average z, and a thick ring says that it is paid; the thin
    hand is the phase φ that all share. The circles are z_min and z_max.

    Args:
        lifts: of a control step; None before the first, or without a lift objective.
        colours: of the fingers.
    """
    body = "".join(_dial(i, lifts, hex_of(c)) for i, c in enumerate(colours))
    size = f'viewBox="0 0 {BESIDE * len(colours)} {HEIGHT}" width="100%"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size}>{body}</svg>'


def _dial(index: int, lifts: Lifts | None, colour: str) -> str:
    x, y = BESIDE * (index + 0.5), 36.0
    params = LiftParams()
    full, least = float(params.amplitude_high_mps), float(params.amplitude_low_mps)
    parts = [
        _circle(x, y, RADIUS, "#bbb", "#fff"),
        _circle(x, y, RADIUS * least / full, "#ccc", "none"),
    ]
    note = ""
    if lifts is not None:
        parts.append(_hand(x, y, RADIUS, lifts.phase_rad, "#999", 1.0))
        real, imaginary = (float(v) for v in lifts.average_mps[index])
        size = math.hypot(real, imaginary)
        length = RADIUS * min(size / full, 1.2)
        angle = math.atan2(imaginary, real)
        parts.append(_hand(x, y, length, angle, colour, 4.0))
        if lifts.paid[index]:
            parts.append(_circle(x, y, RADIUS + 4, colour, "none", 3.0))
        note = f"{1000 * size:.0f} mm/s"
    parts += [_text(x, 80, FINGERS[index], colour), _text(x, 93, note, "#666")]
    return "".join(parts)


def _circle(
    x: float, y: float, radius: float, stroke: str, fill: str, width: float = 1.0
) -> str:
    where = f'cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}"'
    return f'<circle {where} stroke="{stroke}" fill="{fill}" stroke-width="{width}"/>'


def _hand(
    x: float, y: float, length: float, angle_rad: float, stroke: str, width: float
) -> str:
    """A line from the middle; angles count from the right, against the clock."""
    tip = np.array([x, y]) + length * np.array([np.cos(angle_rad), -np.sin(angle_rad)])
    where = f'x1="{x:.1f}" y1="{y:.1f}" x2="{tip[0]:.1f}" y2="{tip[1]:.1f}"'
    how = f'stroke="{stroke}" stroke-width="{width}" stroke-linecap="round"'
    return f"<line {where} {how}/>"


def _text(x: float, y: float, text: str, fill: str) -> str:
    where = f'x="{x:.1f}" y="{y:.1f}" text-anchor="middle"'
    return f'<text {where} font-size="11" fill="{fill}">{text}</text>'
