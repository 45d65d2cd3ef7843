"""Which column holds the effort of a drive, and how many newton-metres its unit is."""

from collections.abc import Mapping, Sequence

import numpy as np

from envs.errors import InputError
from sysid.description.law import (
    Estimate,
    enough,
    friction_sign,
    joined,
    regression,
    rows_of,
)
from sysid.description.stretches import Stretch
from sysid.drive import EFFORTS, Effort, Nominal
from sysid.logs.log import MeasuredLog

UNITS: Mapping[str, float] = {
    "N·m": 1.0,
    "kgf·cm": 0.0980665,
    "N·cm": 0.01,
    "ozf·in": 0.00706155,
    "mN·m": 0.001,
}
"""N·m per unit of what drives report as torque."""

NEAR = 0.25
"""Largest relative deviation at which a unit is recognized; masses are off by less."""

CERTAIN = 0.15
"""Relative standard error below which a record says how large a unit is."""

EXPLAINED = 0.5
"""Share of the motion's torque below which an effort is not what moves the joint."""


def effort_column(logs: Sequence[MeasuredLog], joint: str) -> tuple[Effort, str]:
    """Returns the column of the effort that all records have, and why that one.

    A torque is preferred to a current and that to a duty; a column without sign is of
    no use.
    """
    unsigned = []
    for quantity in EFFORTS:
        name = f"{quantity}.{joint}"
        if all(name in log.columns for log in logs):
            values = np.concatenate([log.samples(name)[1] for log in logs])
            if values.min() < 0.0 < values.max():
                return quantity, "has a sign"
            unsigned.append(name)
    if unsigned:
        return "none", f"{', '.join(unsigned)} without sign says no direction"
    return "none", "no column tau, cur or duty in all records"


def effort_scale(
    stretches: Sequence[Stretch], column: str, where: tuple[str, str]
) -> tuple[Nominal, str]:
    """K of k u − F sign q̇ − b q̇ = I q̈ − m · g: N·m per unit of the effort.

    Args:
        stretches: of the joint.
        column: quantity of the effort.
        where: source and name of the column, for messages.

    Returns:
        The figure, and in words where it comes from.

    Raises:
        InputError: an effort that drives the joint backwards.

    Source:
        Ours; the equation is that of load identification: J. Hollerbach et al., Model
        Identification, Springer Handbook of Robotics, 2nd ed., ch. 6.
    """
    rows = rows_of(stretches)
    if not enough(rows):
        return Nominal(1.0, 0.05, column != "tau"), "too few rows count to show it"
    found = _balance(stretches, rows)
    scale, sd = float(found.theta[0]), float(found.sd[0])
    certain = found.share > EXPLAINED and sd < CERTAIN * abs(scale)
    if not certain:
        said = "the motion does not show it"
        free = column != "tau"
        value = scale if free and scale > 0.0 else 1.0
        return Nominal(float(f"{value:.4g}"), 0.05, free), said
    if scale < 0.0:
        found_here = f"{scale:.3g} N·m per unit by the masses of the MJCF file"
        raise InputError(*where, found_here, "an effort in the direction of the angle")
    measured = f"by the masses of the MJCF file {scale:.4g} ± {sd:.2g}"
    unit, size = min(UNITS.items(), key=lambda known: abs(scale / known[1] - 1.0))
    if column == "tau" and abs(scale / size - 1.0) < NEAR:
        return Nominal(size, 0.05), f"{unit}: {measured}"
    return Nominal(float(f"{scale:.4g}"), 0.3), measured


def _balance(stretches: Sequence[Stretch], rows: list[np.ndarray]) -> Estimate:
    """Factors of effort, speed and friction that balance what the motion takes."""
    effort, vel, need = (
        joined([getattr(s, name) for s in stretches], rows)
        for name in ("effort", "vel", "need_nm")
    )
    sign = friction_sign(vel, float(np.percentile(np.abs(vel), 98)))
    return regression(np.column_stack([effort, -vel, -sign]), need)
