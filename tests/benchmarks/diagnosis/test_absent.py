"""Effects that are absent: each has a record of another one, and a rule for winning."""

import dataclasses

import pytest

from benchmarks.diagnosis.absent import IN_ITS_PLACE, absent_tasks, table, wins
from benchmarks.diagnosis.battery import run_task
from benchmarks.diagnosis.plan import CATALOGUE
from benchmarks.diagnosis.score import Row

HIDDEN = Row(
    group="single",
    seed=1,
    kind="pendulum",
    effects=("deadband",),
    joint="j",
    magnitude="strong",
    ratio=4.0,
    verdict="found",
    causes=("coulomb_friction",),
    conditions={"effort": "True"},
)


def test_every_effect_is_absent_in_two_records():
    assert set(IN_ITS_PLACE) == set(CATALOGUE)
    pairs = absent_tasks()
    assert all(a not in task.effects for a, task in pairs)
    assert len({task.seed for _, task in pairs}) == 2 * len(CATALOGUE)
    efforts = [task.conditions.effort for _, task in pairs]
    assert efforts.count(True) == efforts.count(False) == len(CATALOGUE)


@pytest.mark.parametrize(
    ("changed", "won"),
    [
        ({}, True),
        ({"causes": ("coulomb_friction", "deadband")}, False),
        ({"alternatives": ("deadband",)}, False),
        ({"others": ("deadband",)}, False),
        ({"causes": ("viscous_friction",)}, False),
        ({"causes": (), "verdict": "none"}, False),
    ],
)
def test_an_absent_effect_wins_alone(changed, won):
    row = dataclasses.replace(HIDDEN, **changed)
    assert wins("coulomb_friction", row) is won
    text = table([("coulomb_friction", row)])
    assert ("**wins**" in text) is won
    assert text.endswith(f"{int(won)} of 1 absent effects win")


def test_dry_friction_does_not_fall_with_speed():
    """By the equations it does; the angle does not say so."""
    pairs = [(a, t) for a, t in absent_tasks() if a == "stribeck_friction"]
    (row,) = [run_task(task) for _, task in pairs if task.conditions.effort]
    assert (row.note, row.verdict, row.causes) == ("", "found", row.effects)
    assert row.effects == ("coulomb_friction",)
    assert row.evidence["servo"]["stribeck_friction"] > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("absent", ["load_friction", "hysteresis", "torque_limit"])
def test_what_is_not_there_is_not_named_alone(absent):
    rows = [run_task(task) for name, task in absent_tasks() if name == absent]
    assert [row.note for row in rows] == ["", ""]
    assert not any(wins(absent, row) for row in rows)
