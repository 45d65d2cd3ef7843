"""Candidates share programs, and none changes by the company it has."""

import numpy as np
import pytest
from support.plain_servo import problem_with

from sysid.diagnosis.fits.programs import COSTLY, programs
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


def test_many_kinds_share_the_program_of_all():
    problem = problem_with()
    there = [e for e in COSTLY if problem.space.of(e)]
    found = list(
        programs(problem.space, candidates(problem, (), *((e,) for e in there)))
    )
    assert len(there) > 2
    assert [len(who) for _, who in found] == [1, len(there)]
    assert set(there) <= set(found[1][0])


def test_company_changes_no_angle():
    problem = problem_with(row_s=0.004)
    sets = [(), ("backlash",), ("thermal_derating",), ("slew_limit",), ("armature",)]
    rows = candidates(problem, *sets)
    together = simulated(problem, rows)
    alone = np.concatenate([simulated(problem, row[None]) for row in rows])
    assert together == pytest.approx(alone, abs=2e-6)
    assert np.abs(together[1:] - together[0]).max((1, 2)).min() > 5e-5
