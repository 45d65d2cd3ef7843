"""A play of a fifth of the motion: far from small ones, and hard to follow."""

import numpy as np
import pytest
from support.plain_servo import problem_with

from benchmarks.diagnosis.battery import run_task
from benchmarks.diagnosis.plan import wide_plan
from sysid.diagnosis.fits import space

NARROW = {"rad": (0.004, 0.01, 0.025, 0.06, 0.15, 0.4)}
"""Plays of at most 4 % of the motion."""


def test_searches_begin_at_every_play_that_the_motion_can_show():
    problem = problem_with()
    (where,) = problem.space.of("backlash")
    slot, motion = problem.space.slots[where], problem.data.angle_scale
    sizes = np.array([float(slot.value(u)) for u in slot.starts]) / motion
    assert sizes[-1] == pytest.approx(0.25)
    assert np.all(sizes[1:] / sizes[:-1] < 3.0)


def said():
    """The verdict on a pendulum whose servo has a play of 0.2 rad."""
    row = run_task(wide_plan(5635306, [44])[0])
    assert row.effects == ("backlash",)
    return row.verdict, row.causes


@pytest.mark.slow
def test_a_large_play_is_found():
    assert said() == ("found", ("backlash",))


@pytest.mark.slow
def test_from_small_ones_alone_it_is_not(monkeypatch):
    monkeypatch.setattr(space, "_GRIDS", space._GRIDS | NARROW)
    assert said()[1] != ("backlash",)
