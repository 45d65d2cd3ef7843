r"""For every effect, records in which it is absent and could stand for what is there.

    PYTHONPATH=.:deploy python -m benchmarks.diagnosis.absent --workers 2 --out absent

What is hidden is the effect whose error the absent one alone removes best, in the
records of two batteries (`benchmarks/results/battery-wide-6007.jsonl` and `…-7411`,
field `evidence`), or the nearest by its equation where none came near. Each pair is
recorded without repeats, once with the effort logged and once without. The absent
effect has won if the verdict names it, and the hidden one neither as a cause nor beside
one.
"""

import argparse
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.diagnosis.battery import run_all
from benchmarks.diagnosis.hidden.conditions import Conditions
from benchmarks.diagnosis.plan import NEEDS_COMPANY, Task
from benchmarks.diagnosis.score import Row

IN_ITS_PLACE: Mapping[str, str] = {
    "armature": "payload_com",
    "asymmetric_friction": "stribeck_friction",
    "asymmetric_viscous": "supply_sag",
    "backlash": "encoder_eccentricity",
    "clock_drift": "asymmetric_viscous",
    "command_quantization": "asymmetric_friction",
    "compliance": "transport_delay",
    "coulomb_friction": "deadband",
    "damping": "encoder_scale",
    "deadband": "command_quantization",
    "directional_slew": "slew_limit",
    "encoder_eccentricity": "encoder_scale",
    "encoder_offset": "payload_com",
    "encoder_scale": "mount_tilt",
    "hysteresis": "coulomb_friction",
    "joint_coupling": "encoder_scale",
    "load_friction": "asymmetric_friction",
    "lowpass_cutoff": "transport_delay",
    "mount_tilt": "encoder_offset",
    "payload_com": "encoder_scale",
    "payload_mass": "armature",
    "sensor_latency": "transport_delay",
    "slew_limit": "encoder_eccentricity",
    "start_torque": "deadband",
    "stiffness": "encoder_scale",
    "stribeck_friction": "coulomb_friction",
    "supply_sag": "torque_limit",
    "thermal_derating": "supply_sag",
    "torque_limit": "supply_sag",
    "torque_slope_limit": "transport_delay",
    "transport_delay": "sensor_latency",
    "viscous_friction": "coulomb_friction",
    "acceleration_limit": "slew_limit",
}
"""Absent effect -> the one that is hidden; a new one comes last, so that the others
keep their records."""

SEED = 1201
"""Of the records; taken before any of them was diagnosed."""

LOWPASS_HZ, RATE_HZ = 15.0, 100.0
MAGNITUDE = "strong"


def absent_tasks(seed: int = SEED) -> list[tuple[str, Task]]:
    """Returns each effect that is absent, with records of what is in its place.

    Args:
        seed: of the records.
    """
    tasks = []
    for number, (absent, hidden) in enumerate(IN_ITS_PLACE.items()):
        rig = NEEDS_COMPANY if absent == "joint_coupling" else "pendulum"
        for offset, effort in enumerate((True, False)):
            conditions = Conditions(
                rig, LOWPASS_HZ, effort, rate_hz=RATE_HZ, repeats=False
            )
            own = 2 * number + offset
            numbers = (own, seed * 100_003 + own)
            task = Task(*numbers, "single", (hidden,), MAGNITUDE, conditions)
            tasks.append((absent, task))
    return tasks


def wins(absent: str, row: Row) -> bool:
    """Whether an effect that is not there is named, and what is there is not.

    Args:
        absent: the effect that is not there.
        row: the verdict on the record.
    """
    said = {*row.causes, *row.alternatives, *row.others}
    return absent in row.causes and not said & set(row.effects)


def table(pairs: Sequence[tuple[str, Row]]) -> str:
    """Returns the verdicts as a table, and how many absent effects won.

    Args:
        pairs: absent effect and verdict.
    """
    lines = ["| absent | hidden | effort | verdict | |", "|---|---|---|---|---|"]
    for absent, row in pairs:
        effort = "logged" if row.conditions["effort"] == "True" else "no"
        verdict = f"{row.verdict} {' + '.join(row.causes)}".strip()
        sign = "**wins**" if wins(absent, row) else ""
        hidden = "+".join(row.effects)
        lines.append(f"| {absent} | {hidden} | {effort} | {verdict} | {sign} |")
    won = sum(wins(absent, row) for absent, row in pairs)
    return "\n".join([*lines, "", f"{won} of {len(pairs)} absent effects win"])


def main() -> None:
    """Runs from the command line."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument(
        "--only", nargs="+", default=list(IN_ITS_PLACE), choices=IN_ITS_PLACE
    )
    parser.add_argument("--out", type=Path, default=Path("absent"))
    args = parser.parse_args()
    wanted = [(a, task) for a, task in absent_tasks() if a in args.only]
    tasks = [task for _, task in wanted]
    rows = run_all(tasks, args.workers, args.out, f"absent-{SEED}.jsonl")
    found = {row.seed: row for row in rows}
    text = table([(a, found[t.seed]) for a, t in wanted if t.seed in found])
    (args.out / "absent.md").write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
