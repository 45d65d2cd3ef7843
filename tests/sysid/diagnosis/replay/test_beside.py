"""What other joints do is read in time, however late a joint's own readings are."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from support.plain_servo import problem_with

from sysid.diagnosis.simulated.closed_loop import simulated

STEPS = 4


def with_track(problem, **fields):
    """The problem with fields of its track changed."""
    fields = {name: jnp.asarray(x, jnp.float32) for name, x in fields.items()}
    track = replace(problem.data.track, **fields)
    return replace(problem, data=replace(problem.data, track=track))


def late_by(problem, steps):
    """Coordinates of a joint whose readings are late by some steps of the grid."""
    theta = problem.space.nominal.copy()
    (latency,) = problem.space.of("sensor_latency")
    slot = problem.space.slots[latency]
    theta[latency] = slot.coordinate(steps * problem.data.dt)
    return theta[None]


def turning_load(problem):
    """A mass that another joint moves: pulls that differ by a newton metre."""
    t_s = np.arange(len(problem.data.track.pos)) * problem.data.dt
    moment = np.zeros((*problem.data.track.moment.shape,))
    moment[..., 2] = 0.05 * np.sin(9.0 * t_s)[:, None]
    return moment


def test_an_equation_reads_masses_that_others_move_as_late_as_its_joint_is():
    problem = problem_with(row_s=0.004)
    moment = turning_load(problem)
    nowhere = np.zeros_like(problem.data.track.axis)
    late = with_track(problem, moment=moment, axis=nowhere)
    earlier = np.concatenate([moment[:1]] * STEPS + [moment[:-STEPS]])
    moved = with_track(problem, moment=earlier, axis=nowhere)
    found = late.raw(late_by(late, STEPS))[0, 1]
    away = found - moved.raw(late_by(moved, 0))[0, 1]
    on_time = late.raw(late_by(late, 0))[0, 1]
    assert np.abs(away).max() < 1e-4
    assert np.abs(found - on_time).max() > 0.02


def test_a_joint_alone_balances_alike_whenever_it_was_read():
    """Its own masses turn with it: of the logged effort nothing is late."""
    problem = problem_with(row_s=0.004)
    on_time, late = (problem.raw(late_by(problem, n))[0, 1] for n in (0, 2.5 * STEPS))
    assert np.abs(late - on_time).max() < 1e-3


def test_a_simulation_reads_masses_that_others_move_as_late_as_its_joint_is():
    problem = problem_with(row_s=0.004)
    moment = turning_load(problem)
    problem = with_track(problem, moment=moment, axis=0.0 * moment)
    on_time, late = (simulated(problem, late_by(problem, n))[0] for n in (0, STEPS))
    away = late[100 + STEPS :] - on_time[100:-STEPS]
    assert np.abs(away[:-30]).max() < 2e-5


@pytest.mark.parametrize(
    ("effect", "value"), [("sensor_latency", 0.016), ("clock_drift", -300.0)]
)
def test_a_late_candidate_changes_none_in_time(effect, value):
    """Not by a bit: a fit's slopes are differences, and may lead it elsewhere."""
    problem = problem_with(row_s=0.004)
    in_time, late = np.stack([problem.space.nominal] * 2)
    (where,) = problem.space.of(effect)
    late[where] = problem.space.slots[where].coordinate(value)
    together = simulated(problem, np.stack([in_time, late]))
    alone = [simulated(problem, theta[None])[0] for theta in (in_time, late)]
    assert np.array_equal(together, alone)
    assert np.abs(together[1] - together[0]).max() > 1e-5
