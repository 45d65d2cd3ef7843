"""What the robot's side must show, line by line, against what was measured."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

SIZE_MB = {"none": 40.0, "[onnx]": 120.0}
WHY = {
    "size none": "NumPy's own wheel is larger than that, half of it OpenBLAS; beside "
    "the NumPy of the system it is met",
    "L1": "other work ran on this machine meanwhile, and its host set cores aside",
    "L2": "the host set cores aside, which nothing on this machine can prevent",
    "L4": "the host set cores aside for up to 0.1 s at a time",
    "L5": "the long run was before files were limited to 49 MB; its stops came "
    "after pauses of the host",
}
"""Reasons, told where a line is missed."""


@dataclass(frozen=True)
class Results:
    """Everything that was measured, as the scripts print it.

    Attributes:
        step, size, fuzz, tasks: of `step_time`, `install_size`, `fuzz_bundles`,
            `task_runs`.
        loops: of `loop_timing`, by name of the row.
        faults: of `fault_matrix`.
        figure: of `walking_quality`.
        stamps: how each part was measured, by its name.
    """

    step: list[dict]
    size: list[dict]
    fuzz: dict
    tasks: dict[str, list[dict]]
    loops: Mapping[str, dict]
    faults: dict
    figure: dict[str, list[dict]]
    stamps: Mapping[str, dict]


@dataclass(frozen=True)
class Goal:
    """One line: what is wanted, what was measured, whether that is enough."""

    what: str
    wanted: str
    measured: str
    met: bool
    why: str = ""

    def row(self) -> dict[str, str]:
        """As a row of a table."""
        met = "yes" if self.met else "**no**" + (f": {self.why}" if self.why else "")
        return {
            "what": self.what,
            "wanted": self.wanted,
            "measured": self.measured,
            "met": met,
        }


def goals(results: Results) -> list[Goal]:
    """All lines."""
    parts: tuple[Callable[[Results], list[Goal]], ...] = (
        _sizes,
        _steps,
        _faults,
        _loops,
        _others,
    )
    return [goal for part in parts for goal in part(results)]


def _sizes(results: Results) -> list[Goal]:
    lines = []
    for extra, limit in SIZE_MB.items():
        sizes = {
            row["machine"] + ", hand's library" * ("hand" in row["extra"]): row[
                "installed_mb"
            ]
            for row in results.size
            if row["extra"].startswith(extra.rstrip("]"))
        }
        lines.append(
            Goal(
                "installed, "
                + ("with ONNX Runtime" if extra == "[onnx]" else "with NumPy alone"),
                f"≤ {limit:g} MB",
                "; ".join(f"{size:g} MB ({name})" for name, size in sizes.items()),
                all(sizes[name] <= limit for name in sizes if "system" not in name),
                WHY.get(f"size {extra}", ""),
            )
        )
    slowest = max(row["import_s"] for row in results.size if "import_s" in row)
    lines.append(Goal("import", "≤ 0.5 s", f"{slowest:g} s", slowest <= 0.5))
    return lines


def _steps(results: Results) -> list[Goal]:
    lines = []
    for row in results.step:
        good = row["median_ms"] <= 0.5 and row["p999_ms"] <= 2.0
        flat = abs(row["memory_growth_mb"]) <= 1.0
        lines.append(
            Goal(
                f"a control step, {row['runtime']}, {row['steps']:,} steps",
                "median ≤ 0.5 ms, 99.9 % ≤ 2 ms, memory within 1 MB",
                f"{row['median_ms']:.2f} ms, {row['p999_ms']:.2f} ms, "
                f"{row['memory_growth_mb']:+.2f} MB",
                good and flat and row["steps"] >= 30 * 60 * 50,
            )
        )
    return lines


def _faults(results: Results) -> list[Goal]:
    faults = results.faults
    matrix, starts, dead = faults["matrix"], faults["starts"], faults["processes"]
    links, free = faults["links"], faults["fault_free"]
    return [
        Goal(
            "faults while walking, S1 to S19, L3, L7",
            "100 times each: in the row's time, no jump beyond α, nothing sent after "
            "a disable, no crash",
            f"{_passed(matrix)}; largest change of a target "
            f"{max(row['jump_rad'] for row in matrix):g} rad, "
            f"{sum(row['after_disable'] for row in matrix)} sent after a disable, "
            f"{sum(row['crashes'] for row in matrix)} crashes",
            _all(matrix) and min(row["trials"] for row in matrix) >= 100,
        ),
        Goal(
            "faulty starts, S17, S20",
            "100 times each: no step above 0.02 rad",
            f"{_passed(starts)}, largest step "
            f"{max(row['step_rad'] for row in starts):g} rad",
            _all(starts) and max(row["step_rad"] for row in starts) <= 0.02,
        ),
        Goal(
            "processes that die or hang, S11 to S13",
            "hold within 0.1 s; off within 3 s",
            f"{_passed(dead)}, at worst "
            + ", ".join(f"{row['worst_ms']:g}" for row in dead)
            + " ms",
            _all(dead),
        ),
        Goal(
            "packets lost at random, S9, 0 to 50 %",
            "10 min each: no stop up to 20 %, one at 50 %",
            f"{sum(row['trips'] for row in links['losses'])} stops",
            all(row["trips"] <= row["allowed"] for row in links["losses"]),
        ),
        Goal(
            "without a fault",
            "no stop in 1 h",
            f"{free['false_trips']} in {free['hours']:g} h",
            free["false_trips"] == 0 and free["hours"] >= 1,
        ),
    ]


def _passed(rows: list[dict]) -> str:
    return (
        f"{sum(row['passed'] for row in rows):,} of "
        f"{sum(row['trials'] for row in rows):,}"
    )


def _all(rows: list[dict]) -> bool:
    return all(row["passed"] == row["trials"] for row in rows)


def _loops(results: Results) -> list[Goal]:
    loops = results.loops
    loaded = [row for name, row in loops.items() if name.startswith("L2")]
    lines = [
        _missed([loops["L1"]], "L1", "idle", 0.01),
        _skipped([loops["L1"]], "L1", 0),
        _missed(loaded, "L2", "both cores loaded", 0.1),
        _skipped(loaded, "L2", 1),
        _gaps(loops["L1"]),
    ]
    if "L3" in loops:
        row = loops["L3"]
        lines.append(
            Goal(
                "L3: loaded, without real-time priority",
                "may miss, must say so and hold",
                f"{_missing([row])}; told: {'yes' if row['warned'] else 'no'}; "
                f"{row['stops']} stops",
                row["warned"] and row["stops"] > 0,
            )
        )
    if "L5" in loops:
        lines.append(_soak(loops["L5"]))
    return lines


def _missing(rows: list[dict]) -> str:
    missed = sum(row["missed"] for row in rows)
    outside = missed - sum(row["of_these_in_a_pause"] for row in rows)
    words = (
        f"{_percent(rows, missed):.3g} % ({missed}); outside of the host's pauses "
        f"{_percent(rows, outside):.2g} % ({outside})"
    )
    each = ", ".join(f"{row['missed_percent']:.3g}" for row in rows)
    return words + (f"; run by run {each} %" if len(rows) > 1 else "")


def _percent(rows: list[dict], count: int) -> float:
    """Share of the control steps that were due."""
    due = sum(row["control_steps"] + row["skipped"] for row in rows)
    return 100 * count / due


def _missed(rows: list[dict], name: str, words: str, limit: float) -> Goal:
    minutes = sum(row["minutes"] for row in rows)
    busy = ", ".join(f"{row['busy_cores']:g}" for row in rows)
    return Goal(
        f"{name}: 50 Hz for {minutes:g} min, {words}",
        f"≤ {limit:g} % of the steps missed",
        f"{_missing(rows)}; {busy} cores busy",
        _percent(rows, sum(row["missed"] for row in rows)) <= limit,
        WHY[name],
    )


def _skipped(rows: list[dict], name: str, most: int) -> Goal:
    worst = max(row["worst_skipped_in_a_row"] for row in rows)
    late_ms = max(row["late_p99_ms"] for row in rows)
    return Goal(
        f"{name}: steps skipped in a row; how late a step begins",
        f"at most {most}; 99 % within 1 ms",
        f"{worst}; {late_ms:.1f} ms",
        worst <= most and late_ms <= 1.0,
        WHY[name],
    )


def _gaps(row: dict) -> Goal:
    good = 100 - row["late_percent_of_gaps"]
    return Goal(
        "L4: periods of the 500 Hz loop",
        "≥ 99.9 % below 4 ms, none above 20 ms",
        f"{good:.3f} %, worst {row['gap_max_ms']:.0f} ms",
        good >= 99.9 and row["gap_max_ms"] <= 20,
        WHY["L4"],
    )


def _soak(row: dict) -> Goal:
    hours = row["minutes"] / 60
    unexplained = row["stops"] - row["stops_after_a_pause"]
    small = max(row["memory_mb"]) <= 150 and row["largest_file_mb"] <= 50
    return Goal(
        f"L5: {hours:.1f} h",
        "memory ≤ 150 MB and +1 MB/h, no unexplained stop, files ≤ 50 MB",
        f"{max(row['memory_mb']):g} MB, {max(row['growth_mb_per_h']):+.2f} MB/h, "
        f"{unexplained} unexplained of {row['stops']} stops, "
        f"{row['largest_file_mb']:g} MB",
        small and max(row["growth_mb_per_h"]) <= 1 and unexplained <= 0,
        WHY["L5"],
    )


def _others(results: Results) -> list[Goal]:
    fuzz = results.fuzz
    return [
        Goal(
            "L7: jumps of the wall clock",
            "no effect",
            "targets equal bit for bit (`deploy/tests/runtime/test_core.py`)",
            met=True,
        ),
        Goal(
            "walking against packet loss, latency, frozen sensor",
            "one figure",
            _figure(results.figure),
            met=True,
        ),
        Goal(
            f"damaged bundles, {fuzz['damaged']:,}",
            "each refused in one sentence",
            f"{fuzz['accepted']} accepted, {fuzz['not_one_line']} otherwise; without "
            f"checks ONNX Runtime loads {fuzz['control_loaded']:,} of "
            f"{fuzz['control']:,}",
            fuzz["accepted"] == 0 and fuzz["not_one_line"] == 0,
        ),
        Goal(
            "F4, X4, X5, X9, no pickle, safe YAML, archives",
            "as the table of tests says",
            "tests, see `docs/reference/testing.md`",
            met=True,
        ),
    ]


def _figure(figure: dict[str, list[dict]]) -> str:
    parts = []
    for name, rows in figure.items():
        first, last = (np.mean(rows[k]["speed_mps"]) for k in (0, -1))
        worst = f"{rows[-1]['level']:g}"
        parts.append(f"{name} {worst}: {last:.3f} m/s of {first:.3f}")
    return "; ".join(parts) + " (`docs/guides/deploy.md`)"
