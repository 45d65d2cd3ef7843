"""What is proposed for the drive of one joint, why, and what only its owner knows."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from envs.errors import InputError
from sysid.description.effort import effort_scale
from sysid.description.law import Law, enough, joined, rows_of, servo_law
from sysid.description.stretches import Stretch
from sysid.description.suggested import suggested_effects
from sysid.diagnosis.measured.segments import SLOW_S
from sysid.drive import Effort, JointDrive, Nominal, Part

LAW = 0.8
"""Share of an effort below which another law than gains on the angle drives."""

VELOCITY_LOOP = "gains of a drive with a velocity loop go into `cascade`"
"""What its owner may know of another law."""

KNOWN = 0.05
"""Tolerance of a figure that its owner gives."""

QUESTIONS = {
    "kp": "position gain by manual or firmware [N·m/rad]",
    "kd": "velocity gain by manual or firmware [N·m·s/rad]",
    "effort_scale": "N·m per unit of the effort, by manual or a scale",
    "known": "does anything unknown push on it, as a floor or a hand does? [y/n]",
}
"""What no record can say, by field of the drive."""


@dataclass(frozen=True)
class Proposal:
    """The drive of one joint.

    Attributes:
        joint: its name.
        drive: what `drive.yaml` is to say.
        why: where the figures come from, by field of the drive.
        suggested: effects that the simulation may have already, as lines of YAML.
        asked: fields that its owner may know better.
    """

    joint: str
    drive: JointDrive
    why: dict[str, str]
    suggested: tuple[str, ...]
    asked: tuple[str, ...]


def proposal(
    joint: str,
    stretches: Sequence[Stretch],
    effort: tuple[Effort, str],
    row_s: float,
    source: str,
    actuators: Sequence[tuple[str, float, float]] = (),
) -> Proposal:
    """Proposes the drive of one joint from its records.

    Args:
        joint: its name.
        stretches: its motion.
        effort: column of its effort, and why that one.
        row_s: time between two readings [s].
        source: of the records, for messages.
        actuators: name and gains of its position actuators in the MJCF file.

    Raises:
        InputError: angle or effort against the direction of targets.
    """
    column, chosen = effort
    why = {"effort": chosen}
    if column == "none":
        scale = Nominal(1.0, 0.02)
        torque = [s.need_nm for s in stretches]
    else:
        where = (source, f"{column}.{joint}")
        scale, why["effort_scale"] = effort_scale(stretches, column, where)
        torque = [scale.value * s.effort for s in stretches]
    _check_direction(stretches, source, joint)
    law = servo_law(stretches, torque, friction=column == "none")
    counted = enough(rows_of(stretches))
    known, why["known"] = _known(law, column, row_s, counted)
    gains = _gains(law, column)
    (kp, why["kp"]), (kd, why["kd"]) = gains["kp"], gains["kd"]
    for name, *given in actuators:
        kp, kd = (Nominal(gain, KNOWN) for gain in given)
        why |= dict.fromkeys(("kp", "kd"), f"actuator {name} of the MJCF file")
    setting = law.setting if law else ""
    if setting:
        why["kp_setting"] = "records with another setting have another gain by it"
    drive = JointDrive(kp, kd, setting, column, scale, known=known)
    asked = ("kp", "kd", *["effort_scale"] * (column != "none"), "known")
    # Rests show neither when a target acted nor how fast the joint went there.
    suggested = () if row_s > SLOW_S else suggested_effects(stretches, law)
    return Proposal(joint, drive, why, suggested, asked)


def answered(made: Proposal, field: str, text: str) -> Proposal:
    """Takes over what the owner of a robot knows.

    Args:
        made: the proposal.
        field: one of those that it asks for.
        text: a positive number; of `known` y or n.

    Raises:
        InputError: another text.
    """
    if field == "known":
        if text not in ("y", "n"):
            raise InputError("answer", field, text, "y or n")
        part = "controller" if text == "y" else made.drive.known
        drive = replace(made.drive, known=part)
    else:
        try:
            value = float(text)
        except ValueError:
            value = np.nan
        if not 0.0 < value < np.inf:
            raise InputError("answer", field, text, "a positive number")
        drive = replace(made.drive, **{field: Nominal(value, KNOWN)})
    return replace(made, drive=drive, why=made.why | {field: "as its owner says"})


def _check_direction(stretches: Sequence[Stretch], source: str, joint: str) -> None:
    """Refuses an angle that falls where its target rises."""
    rows = rows_of(stretches)
    if not enough(rows):
        return
    target = joined([s.command(0.0, np.inf) for s in stretches], rows)
    angle = joined([s.pos for s in stretches], rows)
    if np.ptp(target) > 0.0 and np.corrcoef(target, angle)[0, 1] < -0.8:
        found = "angles that fall where the target rises"
        raise InputError(source, f"pos.{joint}", found, "one direction for both")


def _known(
    law: Law | None, column: str, row_s: float, counted: bool
) -> tuple[Part, str]:
    """Which part of the drive the records can examine; `counted`: in enough rows."""
    if law is None and counted:
        part = "both" if column == "none" else "mechanics"
        return part, "the targets do not move, or are the angles themselves"
    if row_s > SLOW_S:
        part = "both" if column == "none" else "controller"
        said = f"rows {1e3 * row_s:.0f} ms apart show rests alone"
        return part, said if counted else f"{said}, of which there are too few"
    if law is None:
        return "both", "too few rows count to say otherwise"
    if column != "none" and law.share < LAW:
        said = f"gains explain {law.share:.0%} of the effort: another law drives;"
        return "mechanics", f"{said} {VELOCITY_LOOP}"
    what = "torque that the motion takes" if column == "none" else "effort"
    return "both", f"gains explain {law.share:.0%} of the {what}"


def _gains(law: Law | None, column: str) -> dict[str, tuple[Nominal, str]]:
    """Both gains of the law, and where they come from.

    A gain that was read off the record is no knowledge about it: it is where a fit
    begins.
    """
    if law is None:
        nothing = Nominal(1.0, free=True), "the record does not show it"
        return {"kp": nothing, "kd": nothing}
    (low, high), kd = law.kp, max(law.kd, law.kd_sd, 1e-3 * law.kp[0])
    source = "masses and motion" if column == "none" else "effort and error"
    found = f"{law.kd:.4g} ± {law.kd_sd:.2g} from {source}"
    if column == "none":
        found += ", with what friction adds"
    return {
        "kp": (
            Nominal(_rounded(math.sqrt(low * high)), free=True),
            f"{low:.4g} to {high:.4g} from {source}",
        ),
        "kd": (Nominal(_rounded(kd), free=True), found),
    }


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
