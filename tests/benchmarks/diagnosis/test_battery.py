"""The battery's own arithmetic, on verdicts that are known."""

import os
import subprocess
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest
from support.processes import alive

from benchmarks.diagnosis import battery, plan
from benchmarks.diagnosis.battery import REACHED, _shown
from benchmarks.diagnosis.factors import by_factor
from benchmarks.diagnosis.hidden.cases import RATIOS, Case
from benchmarks.diagnosis.hidden.conditions import LEVELS
from benchmarks.diagnosis.score import Row, confusion, report, statistics, upper_bound

ROOT = Path(__file__).parents[3]


def row(group="single", effects=("backlash",), ratio=2.0, **said):
    said = {"verdict": "found", "causes": effects, **said}
    magnitude = {"invisible": "invisible"}.get(group, "medium")
    return Row(group, 1, "pendulum", tuple(effects), "servo", magnitude, ratio, **said)


def perfect():
    return [
        row(errors={"backlash.gap_rad": 0.01}, covered={"x": True}, explained=0.97),
        row(effects=("deadband",), alternatives=("backlash",), ratio=1.3),
        row("none", (), verdict="none"),
        row("double", ("backlash", "deadband")),
        row("outside", ("gear_ripple",), verdict="unexplained", causes=()),
        row("invisible", ("torque_limit",), verdict="not_observable", causes=()),
    ]


def wrong():
    return [
        row(causes=("deadband", "stiffness"), errors={"x": 0.5}),
        row("none", (), verdict="found", causes=("stiffness",)),
        row("double", ("backlash", "deadband"), causes=("backlash",)),
        row("outside", ("gear_ripple",), verdict="found", causes=("backlash",)),
        row("invisible", ("torque_limit",), verdict="none", causes=()),
        row(verdict="error", causes=()),
    ]


def test_figures_of_a_right_and_of_a_wrong_diagnosis():
    good, bad = statistics(perfect()), statistics(wrong())
    rates = ("in named set", "no second cause", "both of two", "outside: unexplained")
    for name in (*rates, "invisible: not observable"):
        assert (good[name]["rate"], bad[name]["rate"]) == (1.0, 0.0), name
    assert good["first medium"] == {"rate": 1.0, "n": 1}
    assert good["first weak"] == {"rate": 1.0, "n": 1}
    assert bad["first medium"] == {"rate": 0.0, "n": 2}
    assert good["set size"] == {"mean": 1.5, "n": 2}
    assert good["size error"]["median"] == 0.01
    assert bad["size error"]["n"] == 0  # of a wrong name no size is right
    assert (good["false alarms"]["rate"], bad["false alarms"]["rate"]) == (0.0, 1.0)
    assert bad["errors raised"]["rate"] == pytest.approx(1 / 6)


def test_what_moves_the_same_counts_as_right_if_it_was_named():
    alone = row(effects=("mount_tilt",), causes=("encoder_offset",))
    named = row(
        effects=("mount_tilt",),
        causes=("encoder_offset",),
        alternatives=("mount_tilt",),
    )
    other = row(effects=("deadband",), causes=("backlash",), alternatives=("deadband",))
    assert [r.right for r in (alone, named, other)] == [False, True, False]
    same = "first or the same, medium"
    assert statistics([named])[same]["rate"] == 1.0
    assert statistics([named])["first medium"]["rate"] == 0.0


def test_upper_bound_is_that_of_the_literature():
    """No alarm in 60 records: less than 4.9 % at 95 %; the rule of three."""
    assert upper_bound(0, 60) == pytest.approx(0.0487, abs=2e-4)
    assert upper_bound(10, 200) == pytest.approx(0.0834, abs=5e-4)
    assert upper_bound(3, 3) == 1.0


def test_rows_read_back_and_are_reported():
    for r in perfect() + wrong():
        assert Row.from_json(r.to_json()) == r
    assert confusion(wrong())["backlash"] == {"deadband": 1, "error": 1}
    text = report(perfect())
    assert "torque_limit (invisible) not_observable 1" in text
    assert "outside: gear_ripple" in text


def test_a_plan_repeats_and_has_all_groups():
    tasks = plan.plan(5, plan.FULL)
    assert tasks == plan.plan(5, plan.FULL) != plan.plan(6, plan.FULL)
    assert len({t.seed for t in tasks}) == len(tasks) == plan.FULL
    groups = [t.group for t in tasks]
    assert groups.count("none") >= 200
    singles = {(t.effects[0], t.magnitude) for t in tasks if t.group == "single"}
    assert len(singles) == 3 * len(plan.CATALOGUE)
    assert all(len(set(t.effects)) == 2 for t in tasks if t.group == "double")


def test_a_wide_record_is_drawn_from_its_number_alone():
    """So that any range of them may run anywhere, in any order."""
    tasks = plan.wide_plan(5, range(300))
    assert plan.wide_plan(5, [217, 3]) == [tasks[217], tasks[3]]
    assert plan.wide_plan(6, [217]) != [tasks[217]]
    assert Counter(t.group for t in tasks) == {
        group: 3 * round(100 * share) for group, share in plan.SHARES.items()
    }
    assert len({t.seed for t in tasks}) == 300


def test_all_levels_of_a_factor_come_equally_often():
    tasks = plan.wide_plan(5, range(100, 200))
    for factor, levels in LEVELS.items():
        if factor != "rig":  # a coupled joint needs another one
            counts = Counter(getattr(t.conditions, factor) for t in tasks)
            assert set(counts) == set(levels)
            assert max(counts.values()) - min(counts.values()) <= 1, factor
    assert len({t.conditions.clock for t in tasks}) == 100
    gains = {t.conditions.gains for t in tasks if "stiffness" in t.effects}
    assert gains <= {"5 %"}  # a gain that nobody knows is no effect
    viscous = [
        t for t in plan.wide_plan(5, range(700)) if "viscous_friction" in t.effects
    ]
    shown = [t.conditions.effort or t.conditions.gains != "unknown" for t in viscous]
    assert len(shown) > 5 and all(shown)  # damping of any size would hide it


def test_what_a_record_does_not_show_is_drawn_again():
    """Of the same group and magnitude, each time another; gains only where known."""
    tasks = plan.wide_plan(5, range(100))
    for task in (t for t in tasks if t.group in ("single", "double", "outside")):
        again = [plan.redrawn(task, number) for number in range(6)]
        assert again == [plan.redrawn(task, number) for number in range(6)]
        assert len({t.effects for t in again}) > 1
        for other in again:
            assert replace(other, effects=task.effects) == task
            assert not set(other.effects) & set(task.effects)
            assert len(set(other.effects)) == len(task.effects)
            outside = [e not in plan.CATALOGUE for e in other.effects]
            assert all(outside) if task.group == "outside" else not any(outside)
            known = task.conditions.gains == "5 %"
            assert known or not {"stiffness", "damping"} & set(other.effects)


def test_a_row_that_shows_too_little_or_too_much_is_refused():
    task = next(
        t for t in plan.wide_plan(5, range(100))
        if t.group == "single" and t.magnitude == "medium"
    )  # fmt: skip
    low, high = REACHED

    def shown(ratio):
        log = SimpleNamespace(columns={})
        stand = SimpleNamespace(mechanism=SimpleNamespace(links=()))
        case = SimpleNamespace(ratio=ratio, logs=(log,), stand=stand)
        return _shown(task, cast(Case, case))

    wanted = RATIOS["medium"]
    shares = (0.9 * low, 1.1 * low, 1.0, 0.9 * high, 1.1 * high)
    found = [shown(share * wanted) for share in shares]
    assert found == [False, True, True, True, False]


def test_ranges_of_cases():
    assert list(battery.numbers("7")) == [7]
    assert list(battery.numbers("20-22")) == [20, 21, 22]


def test_scores_by_factor():
    """One line for each level, from the rows that have it."""
    conditions = {name: str(levels[0]) for name, levels in LEVELS.items()}
    rows = [replace(r, conditions=conditions) for r in perfect() + wrong()]
    table = by_factor(rows).splitlines()
    assert len(table) == 1 + sum(map(len, LEVELS.values()))
    seen = next(line for line in table if line.startswith("effort     True"))
    assert "12" in seen
    assert "1/2 50 %" in seen  # false alarms
    missing = next(line for line in table if line.startswith("effort     False"))
    assert missing.split()[2:4] == ["0", "-"]


def test_a_found_cause_that_makes_it_worse_is_counted():
    worse = row(closed_loop=(0.01, 0.02))
    better = row(closed_loop=(0.02, 0.01))
    rate = statistics([worse, better])["found, and worse in closed loop"]
    assert rate == {"rate": 0.5, "n": 2}


def test_what_is_raised_is_a_row(monkeypatch):
    task = plan.wide_plan(5, [0])[0]

    def broken(task):
        raise RuntimeError("out of memory")

    monkeypatch.setattr(battery, "_case", broken)
    row = battery.run_task(task)
    assert (row.verdict, row.note) == ("error", "RuntimeError: out of memory")


def test_a_process_that_has_done_its_records_is_replaced(tmp_path, monkeypatch):
    """One worker alone stood still after a dozen records; what is done stays done."""
    monkeypatch.setattr(battery, "RECORDS_OF_A_PROCESS", 2)
    tasks = [replace(t, effects=("no_such",)) for t in plan.plan(5, 5)]
    rows = battery.run_all(tasks, 1, tmp_path, "rows.jsonl")
    assert [row.verdict for row in rows] == ["error"] * 5
    assert len({row.seed for row in rows}) == 5
    before = (tmp_path / "rows.jsonl").read_text()
    assert battery.run_all(tasks, 1, tmp_path, "rows.jsonl") == rows
    assert (tmp_path / "rows.jsonl").read_text() == before


CHILDREN = "/proc/{0}/task/{0}/children"


@pytest.mark.skipif(
    not Path(CHILDREN.format(os.getpid())).exists(), reason="no list of processes"
)
def test_a_terminated_battery_takes_its_processes_with_it(tmp_path):
    """They went on with their records, for nobody; each takes longer than 5 s."""
    words = ["--seed", "5", "--records", "1", "--workers", "1", "--out", str(tmp_path)]
    command = [sys.executable, "-m", "benchmarks.diagnosis.battery", *words]
    with subprocess.Popen(command, cwd=ROOT) as process:
        own = Path(CHILDREN.format(process.pid))
        children = []
        while len(children) < 2:  # the worker, and what tracks resources
            assert process.poll() is None
            time.sleep(0.2)
            children = own.read_text().split()
        process.terminate()
    until_s = time.monotonic() + 5.0
    while any(map(alive, children)):
        assert time.monotonic() < until_s, children
        time.sleep(0.2)
