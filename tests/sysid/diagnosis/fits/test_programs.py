"""Candidates share programs, and none changes by the company it has."""

import numpy as np
import pytest
from support.plain_servo import problem_with

from sysid.diagnosis.fits.programs import APART, COSTLY, programs
from sysid.diagnosis.simulated.closed_loop import simulated


def candidates(problem, *sets):
    """Nominal coordinates with some effects at sizes that matter."""
    rows = np.repeat(problem.space.nominal[None], len(sets), 0)
    for row, effects in zip(rows, sets, strict=True):
        for i in (i for e in effects for i in problem.space.of(e)):
            slot = problem.space.slots[i]
            row[i] = np.clip(row[i] + 0.2, slot.low, slot.high)
    return rows


def test_every_candidate_has_one_program_with_its_effects():
    problem = problem_with()
    sets = [(), ("armature",), ("backlash",), ("backlash", "slew_limit"), ("backlash",)]
    found = [
        (program, who.tolist())
        for program, who in programs(problem.space, candidates(problem, *sets))
    ]
    assert sorted(map(tuple, (who for _, who in found))) == [(0, 1), (2, 3, 4)]
    for program, who in found:
        assert ("backlash" in program) == (who != [0, 1])
        assert "armature" in program and "compliance" not in program
        assert "slew_limit" not in program  # of the targets, in front of it


def test_many_kinds_share_a_program_but_for_a_spring():
    problem = problem_with()
    there = [e for e in COSTLY if problem.space.of(e)]
    sets = [(), *((e,) for e in there)]
    found = list(programs(problem.space, candidates(problem, *sets)))
    assert len(there) > 3 and APART == ("compliance",)
    assert [len(who) for _, who in found] == [1, len(there) - 1, 1]
    shared = set(there) - set(APART)
    assert [shared <= set(program) for program, _ in found] == [False, True, True]
    assert ["compliance" in program for program, _ in found] == [False, False, True]
    assert found[2][1].tolist() == [1 + there.index("compliance")]


@pytest.mark.parametrize("more", [(), ("compliance", "payload_com", "hysteresis")])
def test_company_changes_no_angle(more):
    """Of a play least: beside a spring its motor has no inertia."""
    problem = problem_with(row_s=0.004)
    sets = [(), ("backlash",), ("thermal_derating",), ("slew_limit",), ("armature",)]
    rows = candidates(problem, *sets, *((name,) for name in more))
    together = simulated(problem, rows)
    alone = np.concatenate([simulated(problem, row[None]) for row in rows])
    assert together == pytest.approx(alone, abs=2e-6)
    assert np.abs(together[1:] - together[0]).max((1, 2)).min() > 5e-5
