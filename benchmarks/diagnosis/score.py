"""What a battery of hidden cases says about a diagnosis, in numbers.

PYTHONPATH=.:tests python -m benchmarks.diagnosis.score ROWS.jsonl
"""

import json
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import beta

from benchmarks.diagnosis.hidden.truth import OUTSIDE

SAME_MOTION = (
    {"encoder_offset", "mount_tilt", "payload_com"},
    {"transport_delay", "sensor_latency"},
)
"""Effects that one joint on one stand moves by in the same way: gravity's torque shifts
along the angle, or everything measured comes later. Which one is first is a toss."""


FAINT = 1.04
"""Visibility below which a record cannot show what is hidden in it."""


@dataclass(frozen=True)
class Row:
    """One hidden case and the verdict on it.

    Attributes:
        group: `single`, `none`, `double`, `outside` or `invisible`.
        effects, joint, magnitude, ratio, kind, seed: of the case.
        verdict: of the diagnosis, `error` if it raised.
        causes: names in order of gain.
        where: where each cause acts.
        alternatives: effects that are not distinguishable from the first cause.
        others: those that are not distinguishable from one of the further causes.
        not_observable: effects that the diagnosis says it could not see.
        errors: relative size errors by parameter.
        covered: by parameter, whether the interval has the truth.
        explained: share of the removable held-out error that is removed, None if
            there is no gain.
        runtime_s: time of the diagnosis.
        note: message of an error.
        conditions: level of every factor of the wide battery.
        closed_loop: held-out error of the simulated angle before and after, if there
            is one.
        signs: what the diagnosis says remains unexplained.
        evidence: by joint and effects ("a+b", "" for none), log predictive likelihood
            less that of the chosen set.
    """

    group: str
    seed: int
    kind: str
    effects: tuple[str, ...]
    joint: str
    magnitude: str
    ratio: float
    verdict: str
    causes: tuple[str, ...] = ()
    where: tuple[str, ...] = ()
    alternatives: tuple[str, ...] = ()
    others: tuple[str, ...] = ()
    not_observable: tuple[str, ...] = ()
    errors: dict[str, float] = field(default_factory=dict)
    covered: dict[str, bool] = field(default_factory=dict)
    explained: float | None = None
    runtime_s: float = 0.0
    note: str = ""
    conditions: dict[str, str] = field(default_factory=dict)
    closed_loop: tuple[float, ...] = ()
    signs: tuple[str, ...] = ()
    evidence: dict[str, dict[str, float]] = field(default_factory=dict)

    @property
    def named(self) -> set[str]:
        """The first cause and what cannot be distinguished from it."""
        return {*self.causes[:1], *self.alternatives} if self.causes else set()

    @property
    def everything(self) -> set[str]:
        """All causes and what cannot be distinguished from one of them."""
        return {*self.causes, *self.alternatives, *self.others}

    @property
    def has_both(self) -> bool:
        """Whether the effects of a pair are causes, or named beside one.

        One cause with its alternatives stands for one effect only.
        """
        enough = len(self.causes) >= len(self.effects)
        return set(self.effects) <= self.everything and enough

    @property
    def right(self) -> bool:
        """Whether the effect is first, or named beside a first that moves the same."""
        name = self.effects[0]
        same = any({name, self.first} <= group for group in SAME_MOTION)
        return self.first == name or (same and name in self.named)

    @property
    def first(self) -> str:
        """Column of the confusion matrix."""
        return self.causes[0] if self.causes else self.verdict

    @property
    def strength(self) -> str:
        """Magnitude by the visibility that was reached, not by the one aimed at."""
        limits = (("faint", FAINT), ("weak", 1.65), ("medium", 2.8))
        return next((name for name, top in limits if self.ratio < top), "strong")

    def to_json(self) -> str:
        """Returns one line of JSON."""
        return json.dumps(asdict(self))

    @staticmethod
    def from_json(line: str) -> "Row":
        """Reads `to_json`."""
        data: dict[str, Any] = json.loads(line)
        lists = (
            "effects",
            "causes",
            "where",
            "alternatives",
            "others",
            "not_observable",
            "closed_loop",
            "signs",
        )
        data |= {name: tuple(data[name]) for name in lists if name in data}
        return Row(**data)


def read_rows(path: Path) -> list[Row]:
    """Reads the rows of a battery."""
    return [Row.from_json(line) for line in path.read_text("utf-8").splitlines()]


def upper_bound(events: int, trials: int, level: float = 0.95) -> float:
    """Largest rate that so many events do not rule out (Clopper and Pearson)."""
    if events >= trials:
        return 1.0
    return float(beta.ppf(level, events + 1, trials - events))


def _rate(hits: Iterable[bool]) -> dict[str, float | int]:
    found = [bool(hit) for hit in hits]
    rate = float(np.mean(found)) if found else float("nan")
    return {"rate": rate, "n": len(found)}


def statistics(rows: Sequence[Row]) -> dict[str, dict[str, float | int]]:
    """Returns all scores by name; a rate comes with the number of cases."""
    groups = {g: [r for r in rows if r.group == g] for g in _GROUPS}
    single = groups["single"]
    result = {}
    for strength in ("weak", "medium", "strong"):
        chosen = [r for r in single if r.strength == strength]
        result[f"first {strength}"] = _rate(r.first == r.effects[0] for r in chosen)
        result[f"first or the same, {strength}"] = _rate(r.right for r in chosen)
    visible = [r for r in single if r.verdict != "error"]
    result["in named set"] = _rate(r.effects[0] in r.named for r in single)
    strong = [r for r in single if r.strength in ("medium", "strong")]
    result["in named set, medium and strong"] = _rate(
        r.effects[0] in r.named for r in strong
    )
    sizes = [len(r.named) for r in visible if r.named]
    result["set size"] = {"mean": _mean(sizes), "n": len(sizes)}
    every = [len(r.everything) for r in visible if r.named]
    result["all that is named"] = {"mean": _mean(every), "n": len(every)}
    named = [r for r in single if r.causes]
    result["no second cause"] = _rate(len(r.causes) == 1 for r in named)
    alarms = [r.verdict not in ("none", "not_observable") for r in groups["none"]]
    result["false alarms"] = _rate(alarms) | {
        "upper 95 %": upper_bound(sum(alarms), len(alarms)) if alarms else float("nan")
    }
    doubles = groups["double"]
    result["both of two"] = _rate(set(r.effects) <= set(r.causes) for r in doubles)
    result["both of two, in the named sets"] = _rate(r.has_both for r in doubles)
    result["outside: unexplained"] = _rate(
        r.verdict == "unexplained" for r in groups["outside"]
    )
    result["invisible: not observable"] = _rate(
        not r.causes
        and r.verdict in ("none", "not_observable")
        and (r.verdict == "not_observable" or r.effects[0] in r.not_observable)
        for r in groups["invisible"]
    )
    right = [r for r in single if r.first == r.effects[0]]
    errors = [e for r in right for e in r.errors.values()]
    result["size error"] = {
        "median": float(np.median(errors)) if errors else float("nan"),
        "90 %": float(np.quantile(errors, 0.9)) if errors else float("nan"),
        "n": len(errors),
    }
    result["coverage"] = _rate(c for r in right for c in r.covered.values())
    explained = [r.explained for r in right if r.explained is not None]
    result["error removed"] = {
        "median": float(np.median(explained)) if explained else float("nan"),
        "share of 0.9": _mean([e >= 0.9 for e in explained]),
        "n": len(explained),
    }
    closed = [r for r in rows if r.verdict == "found" and r.closed_loop]
    worse = [r.closed_loop[1] > r.closed_loop[0] for r in closed]
    result["found, and worse in closed loop"] = _rate(worse)
    result["errors raised"] = _rate(r.verdict == "error" for r in rows)
    times = [r.runtime_s for r in rows]
    result["runtime_s"] = {"median": float(np.median(times)) if times else 0.0}
    result["within a minute"] = _rate(s <= 60.0 for s in times)
    return result


_GROUPS = ("single", "none", "double", "outside", "invisible")


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


def confusion(rows: Sequence[Row]) -> dict[str, Counter]:
    """Counts first causes (columns) by hidden effect (rows); pairs are left out."""
    table: dict[str, Counter] = {}
    for row in rows:
        if row.group != "double":
            name = row.effects[0] if row.effects else "none"
            name = f"{name} (invisible)" if row.group == "invisible" else name
            table.setdefault(name, Counter())[row.first] += 1
    return table


def report(rows: Sequence[Row]) -> str:
    """Returns scores and confusion matrix as text."""
    lines = ["hidden effect -> what was named (first cause or verdict)"]
    for name, counts in sorted(confusion(rows).items()):
        found = ", ".join(f"{k} {n}" for k, n in counts.most_common())
        mark = "outside: " if name in OUTSIDE else ""
        lines.append(f"  {mark}{name:24s} {found}")
    lines.append("")
    for name, values in statistics(rows).items():
        text = ", ".join(
            f"{k} {v:.3f}" if isinstance(v, float) else f"{k} {v}"
            for k, v in values.items()
        )
        lines.append(f"  {name:28s} {text}")
    return "\n".join(lines)


if __name__ == "__main__":
    print(report(read_rows(Path(sys.argv[1]))))
