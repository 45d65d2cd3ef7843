"""Weights of the preferences by which a stance is searched."""

from dataclasses import dataclass


@dataclass(frozen=True)
class StanceWeights:
    """Weights of the preferences; each is dimensionless, in the scale named.

    Attributes:
        margin: shortfall of the static margin below 30 mm, per 10 mm.
        one_lifted: shortfall of the margin below 10 mm with any one finger lifted, per
            10 mm. Without it the finger that the hand leans on is dragged, not lifted.
        range: distance of each joint from the middle of its range, per range.
        pad: pad normals above 10° below the horizontal, per 30°.
        clearance: shortfall of the other links' height below 20 mm, per 10 mm.
        step: radians that move a tip 20 mm forward or 15 mm up, per 0.5 rad.
        torque: static joint torque, per torque limit.
        spread: shortfall of the distance of neighbouring tips below 24 mm, per 6 mm.
        order: shortfall of the sideways distance from each finger but the thumb to the
            next below 12 mm, per 4 mm; fingers do not cross.
        centre: horizontal distance from the footprint's centre to the centre of mass,
            per 20 mm.
        height: shortfall of the palm's lowest corner below 45 mm, per 10 mm.
        roll: palm roll, per 10°.
    """

    margin: float = 10.0
    one_lifted: float = 5.0
    range: float = 1.0
    pad: float = 2.0
    clearance: float = 3.0
    step: float = 1.5
    torque: float = 2.0
    spread: float = 2.0
    order: float = 5.0
    centre: float = 0.5
    height: float = 1.0
    roll: float = 1.0
