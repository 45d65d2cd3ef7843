"""Two loops along a motion, against those of the hidden simulator."""

import math
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from support.cascade_rig import exact_log, problem_with, stand_of
from support.plain_servo import problem_with as plain_problem

from sysid.diagnosis.replay.cascade import Integral, follow, with_cascade
from sysid.diagnosis.simulated.closed_loop import simulated
from sysid.logs.log import make_log

EQUATIONS = 0.035
"""Largest error of a torque, as share of the torque's deviation: the smoothing at the
corners of the speed limit leaves 1 to 3.4 %."""

ANGLE_RAD = 5e-4
"""Largest deviation of a simulated angle: 0.1 % of the excursion."""


def state(value):
    value = jnp.asarray(value, jnp.float32)
    none = jnp.zeros_like(value)
    return Integral(value, none, none, none, none)


def test_the_integral_follows_a_torque_with_its_time_constant():
    """z = τ (1 − e^{−r t}) from the first step on, up to half a substep."""
    rate, dt, found = 20.0, 0.001, state([0.0])
    for _ in range(100):
        found = follow(found, jnp.array([2.0]), jnp.array([rate]), dt)
    right = 2.0 * (1.0 - math.exp(-rate * (0.1 - 0.5 * dt)))
    assert float(found.value[0]) == pytest.approx(right, rel=1e-4)


def test_without_a_gain_the_integral_stays():
    found = follow(state([0.3]), jnp.array([2.0]), jnp.array([0.0]), 0.001)
    assert float(found.value[0]) == pytest.approx(0.3)


def test_drives_without_a_cascade_compute_what_they_did():
    problem = plain_problem()
    assert problem.data.track.cascade == {}
    assert "k_int" not in [slot.name for slot in problem.space.slots]
    effects = {"stiffness": {"scale": jnp.ones(1)}}
    assert with_cascade(effects, {}, jnp.ones((1, 1))) == effects


def coordinates(problem, k_int=1.0):
    """Nominal coordinates with a factor of the integral's gain."""
    theta = problem.space.nominal.copy()
    for i, slot in enumerate(problem.space.slots):
        if slot.name == "k_int":
            theta[i] = slot.coordinate(k_int)
    return theta[None]


def equations(problem, **changes):
    """Root mean squares of both residuals [N·m]; NaN where none counts."""
    raw = problem.raw(coordinates(problem, **changes))[0]
    pairs = zip(raw, problem.valid, strict=True)
    return [
        float(np.sqrt(np.mean(r[v] ** 2))) if v.any() else math.nan for r, v in pairs
    ]


def angle_error(problem, **changes):
    angle = simulated(problem, coordinates(problem, **changes))[0]
    away = np.asarray(problem.data.track.pos) - angle
    return float(np.sqrt(np.mean(away[30:-30] ** 2)))


RIGS = {"free": {}, "at its torque limit": {"limit_nm": 0.45}}


@pytest.fixture(scope="module", params=RIGS, ids=str)
def recorded(request):
    """A stand, its exact record and the deviation of its torque [N·m]."""
    stand = stand_of(1, **RIGS[request.param])
    log = exact_log(stand, 1)
    torque = log.column("tau.shoulder")
    at_limit = np.mean(np.abs(torque) > 0.99 * stand.mechanism.joints[0].limit_nm)
    assert (at_limit > 0.03) == bool(RIGS[request.param])
    return stand, log, float(np.std(torque))


def test_a_logged_effort_is_that_of_the_loops(recorded):
    stand, log, torque = recorded
    problem = problem_with(log, stand)
    controller, mechanics = equations(problem)
    assert controller < EQUATIONS * torque
    assert mechanics < 0.01 * torque
    other, same = equations(problem, k_int=0.7)
    assert other > 2.0 * controller
    assert same == pytest.approx(mechanics, rel=1e-3)
    gains_alone = problem_with(log, stand, cascade=None)
    assert equations(gains_alone)[0] > 50.0 * controller


def test_without_an_effort_the_motion_shows_the_loops(recorded):
    stand, log, torque = recorded
    problem = problem_with(log, stand, effort=False)
    _, mechanics = equations(problem)
    assert mechanics < EQUATIONS * torque
    assert equations(problem, k_int=0.7)[1] > 2.0 * mechanics
    gains_alone = problem_with(log, stand, effort=False, cascade=None)
    assert equations(gains_alone)[1] > 50.0 * mechanics


@pytest.mark.parametrize("effort", [True, False])
def test_the_loops_are_in_the_simulation_that_judges(recorded, effort):
    stand, log, _ = recorded
    problem = problem_with(log, stand, effort)
    assert angle_error(problem) < ANGLE_RAD
    assert angle_error(problem, k_int=0.5) > 2.0 * angle_error(problem)
    gains_alone = problem_with(log, stand, effort, cascade=None)
    assert angle_error(gains_alone) > 0.03


def test_behind_a_gap_the_simulation_begins_with_the_torque_there():
    """It began with a wrong one, which a record that goes on remembers."""
    stand = stand_of(2)
    problem = problem_with(exact_log(stand, 2), stand)
    track, row = problem.data.track, 8
    resumed = np.zeros_like(track.resumed)
    resumed[row] = 1.0
    begins = track.cascade["start_nm"] + 0.5

    def most(anew):
        wrong = {**track.cascade, "start_nm": begins}
        changed = replace(track, cascade=wrong, resumed=jnp.asarray(anew))
        there = replace(problem, data=replace(problem.data, track=changed))
        angle = simulated(there, coordinates(there))[0]
        return np.abs(np.asarray(track.pos) - angle)[row + 4 : row + 40].max()

    assert most(resumed) < 2.0 * ANGLE_RAD
    assert most(0.0 * resumed) > 20.0 * ANGLE_RAD


def test_a_step_that_was_lost_is_soon_forgotten():
    stand = stand_of(2, ref_rad_s=math.inf)
    log = exact_log(stand, 2)
    cmd, t_s = log.column("cmd.shoulder"), log.t_s
    steps = t_s[np.flatnonzero(np.abs(np.diff(cmd)) > 0.2)]
    lost = steps[steps > 1.0][0]
    kept = (t_s < lost - 0.02) | (t_s > lost + 0.05)
    columns = {name: x[kept] for name, x in log.columns.items()}
    problem = problem_with(make_log(("shoulder",), t_s[kept], columns), stand)
    track, dt = problem.data.track, problem.data.dt
    (first, *_), last = np.split(np.flatnonzero(np.asarray(track.resumed)[:, 0]), [1])
    whole = simulated(problem, coordinates(problem))[0]

    def most(angle):
        away = np.abs(np.asarray(track.pos) - angle)[:, 0]
        return away[last[-1] + 4 : last[-1] + 60].max()

    once = np.zeros_like(track.resumed)
    once[first] = 1.0
    early = replace(track, resumed=jnp.asarray(once))
    early = replace(problem, data=replace(problem.data, track=early))
    assert dt * (last[-1] - first) > 0.04
    assert most(whole) < 4.0 * ANGLE_RAD
    assert most(simulated(early, coordinates(early))[0]) > 10.0 * ANGLE_RAD
