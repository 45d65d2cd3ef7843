"""A proposed `drive.yaml` as text, with the reason of every figure beside it."""

from collections.abc import Sequence

from sysid.description.proposal import QUESTIONS, Proposal
from sysid.drive import SCHEMA, Masses, Nominal


def drive_text(proposals: Sequence[Proposal], source: str) -> str:
    """Returns `drive.yaml` with comments: why a figure, and what its owner may know.

    Args:
        proposals: of all joints.
        source: the records.
    """
    lines = [
        f"# Proposed from {source}. Gains that were read off the record are free:",
        "# put in what is known of the robot, with a tolerance of its own. No record",
        "# says how well the masses of the MJCF file are known: where a joint has no",
        f"# `masses: {{tolerance: …}}`, {Masses().tolerance:.0%} are expected.",
        f"schema: {SCHEMA}",
        "joints:",
    ]
    for made in proposals:
        lines += ["", f"  {made.joint}:", *(f"    {x}" for x in _joint(made))]
    return "\n".join(lines) + "\n"


def _joint(made: Proposal) -> list[str]:
    """Fields of one joint, each under its reason."""
    drive, lines = made.drive, []
    values = {"kp": _figure(drive.kp), "kd": _figure(drive.kd)}
    if drive.kp_setting:
        values["kp_setting"] = drive.kp_setting
    values["effort"] = drive.effort
    if drive.effort != "none":
        values["effort_scale"] = _figure(drive.effort_scale)
    values["known"] = drive.known
    for field, value in values.items():
        if field in made.asked:
            lines.append(f"# ? {QUESTIONS[field]}")
        lines += [f"# {made.why[field]}", f"{field}: {value}"]
    if made.suggested:
        lines.append("# the record suggests; take in what the simulation has already:")
        lines += ["# effects:", *(f"#   {line}" for line in made.suggested)]
    return lines


def _figure(nominal: Nominal) -> str:
    """A figure in YAML."""
    how = "free: true" if nominal.free else f"tolerance: {nominal.tolerance:g}"
    return f"{{value: {nominal.value!r}, {how}}}"
