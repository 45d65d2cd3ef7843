"""Writes a plan: `targets.csv` for the driver, `plan.yaml` for people."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from envs.actuator.catalogue import effect_kind
from envs.config.typed import dump_yaml
from sysid.excitation.check import Rehearsal
from sysid.excitation.plan import Plan
from sysid.excitation.separation import NO_LIMIT, Separation
from sysid.excitation.waves import WAVES


def write_plan(
    plan: Plan, found: Rehearsal, separations: Sequence[Separation], folder: Path
) -> None:
    """Writes a plan with what it was checked for and what it can show."""
    folder.mkdir(parents=True, exist_ok=True)
    names = [plan.joints.index(joint) for joint in plan.moved]
    with open(folder / "targets.csv", "w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["t", *(f"cmd.{joint}" for joint in plan.joints)])
        for t, row in zip(plan.t_s, plan.targets, strict=True):
            writer.writerow([f"{t:.6g}", *(f"{x:.7g}" for x in row)])
    data = {
        "rate_hz": plan.rate_hz,
        "seed": plan.seed,
        "seconds": len(plan.targets) / plan.rate_hz,
        "limits": asdict(plan.limits),
        "rehearsed": {
            "largest_speed_rad_s": _largest(found.speed, names),
            "largest_torque_nm": _largest(found.torque, names),
            "contacts": "none beside those at rest",
        },
        "segments": [_segment(segment) for segment in plan.segments],
        "shows": {s.joint: _shows(s) for s in separations},
    }
    (folder / "plan.yaml").write_text(dump_yaml(data), encoding="utf-8")


def _largest(values: np.ndarray, names: list[int]) -> float:
    return round(float(np.max(np.abs(values[:, names]))), 4)


def _segment(segment) -> dict[str, Any]:
    sizes = {j: round(a, 5) for j, a in segment.amplitude_rad.items()}
    return {
        "wave": segment.wave,
        "for": WAVES[segment.wave].shows,
        "repeat": segment.repeat,
        "start_s": segment.start_s,
        "stop_s": segment.stop_s,
        "amplitude_rad": sizes,
    }


def _shows(separation: Separation) -> Mapping[str, Any]:
    """Smallest sizes that show, their alternatives, and what does not show."""
    seen = {
        name: {
            "share_of_tried": round(separation.smallest[name], 4),
            "from": {k: _short(a) for k, (a, _) in separation.sizes[name].items()},
            "tried": {k: _short(b) for k, (_, b) in separation.sizes[name].items()},
            "indistinguishable_from": list(separation.confused(name)),
        }
        for name in separation.seen
    }
    hidden = [name for name in separation.effects if name not in seen]
    return {"seen": seen, "not_seen": hidden}


def _short(value: float) -> float:
    return float(f"{value:.4g}")


def separation_lines(separation: Separation) -> list[str]:
    """Says in lines what a plan shows of a joint."""
    lines = [f"{separation.joint}:"]
    for name in separation.seen:
        others = separation.confused(name)
        mixed = f"; not distinguished from {', '.join(others)}" * bool(others)
        size = _size(separation, name)
        lines.append(f"  {name} from {size} on{mixed}")
    hidden = [name for name in separation.effects if name not in separation.seen]
    if hidden:
        lines.append(f"  does not show {', '.join(hidden)}")
    return lines


def _size(separation: Separation, name: str) -> str:
    """Names the smallest change that shows, in the parameters' own units."""
    share, parts = separation.smallest[name], []
    for key, (before, tried) in separation.sizes[name].items():
        unit = effect_kind(name).parameters[key].unit
        unit = "" if unit == "1" else f" {unit}"
        if before >= NO_LIMIT:
            parts.append(f"{key} {tried:.3g}{unit}")
        else:
            parts.append(f"{key} {share * (tried - before):+.2g}{unit}")
    return ", ".join(parts)
