"""A simulated play against a motor and a link that are integrated here."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from support import plain_servo
from support.plain_servo import COULOMB, INERTIA, KD, KP, WEIGHT, problem_with

from envs.actuator.chain import JointInput, chain_step, init_states
from sysid.diagnosis.simulated import play
from sysid.diagnosis.simulated.closed_loop import simulated

MOTOR, GAP, DT_S = 0.001, 0.03, 0.00025


def loose(cmd, row_s, late_s=0.0, push=None, dt=0.00002):
    """Angles and torques of a motor that moves its link by two inelastic walls."""
    q = v = x = w = 0.0  # link and motor
    angle, torque = [], []
    rows = round(row_s / dt)
    for k in range(len(cmd) * rows):
        drive = KP * (cmd[k // rows] - x) - KD * w
        if k % rows == 0:
            angle.append(x)
            torque.append(drive)
        w += dt * drive / MOTOR
        v -= dt * WEIGHT * 9.81 * np.sin(q) / (INERTIA - MOTOR)
        v = np.sign(v) * max(abs(v) - COULOMB * dt / (INERTIA - MOTOR), 0.0)
        if abs(x + dt * w - q - dt * v) > 0.5 * GAP and (w - v) * (x - q) > 0.0:
            v = w = (MOTOR * w + (INERTIA - MOTOR) * v) / INERTIA
        x, q = x + dt * w, q + dt * v
    return np.array(angle), np.array(torque)


@pytest.fixture(scope="module")
def problem():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plain_servo, "servo", loose)
        return problem_with(row_s=0.004)


def error(problem, gap_rad, motor=MOTOR):
    """Deviation of the simulated angle [rad]."""
    theta = problem.space.nominal.copy()
    values = {"backlash.gap_rad": gap_rad, "rotor": motor}
    for i, slot in enumerate(problem.space.slots):
        if slot.label in values:
            theta[i] = slot.coordinate(values[slot.label])
    away = np.asarray(problem.data.track.pos) - simulated(problem, theta[None])[0]
    return float(np.sqrt(np.mean(away[30:-30] ** 2)))


def test_a_motor_crosses_its_gap_as_its_inertia_lets_it(problem):
    """The catalogue's, which follows its servo at once, leaves 0.6 of the error."""
    right = error(problem, GAP)
    assert right < 0.1 * error(problem, 0.0)
    assert error(problem, GAP, 2.0 * MOTOR) > 5.0 * right
    assert error(problem, 0.8 * GAP) > 5.0 * right


def test_a_motor_between_its_walls_begins_anew_as_it_was_read(problem):
    """The link keeps its speed: its encoder, the motor's, does not show it."""
    track = problem.data.track
    resumed = np.zeros(np.shape(track.pos), np.float32)
    for row in range(100, len(resumed) - 120, 120):
        resumed[row : row + 13] = 1.0
    anew = track.replace(resumed=jnp.asarray(resumed))
    again = replace(problem, data=replace(problem.data, track=anew))
    assert error(again, GAP) < 0.15 * error(problem, 0.0)


def test_beside_a_spring_a_play_has_no_motor_of_its_own(problem):
    """The spring's and the play's would be more than the joint."""
    effects = {"backlash": {}, "compliance": {}}
    nuisance, one = (
        problem.space.values(problem.space.nominal[None])[1],
        jnp.ones((1, 1)),
    )
    kinds = [k for k, _ in play.with_motor(effects, nuisance, one, False)]
    assert play.KIND not in kinds
    alone = play.with_motor({"backlash": {}}, nuisance, one, False)
    assert [k for k, _ in alone] == [play.KIND]


@pytest.mark.parametrize("gap_rad", [0.0, GAP])
def test_without_a_gap_motor_and_joint_turn_as_one(gap_rad):
    params = {"gap_rad": gap_rad, "motor_inertia_kgm2": MOTOR, "damped": 0.5}
    model = ((play.KIND, {k: jnp.asarray([x]) for k, x in params.items()}),)
    states = init_states(model, jnp.zeros(1), jnp.zeros(1), DT_S)
    for speed in (0.0, 0.3, -0.2):
        given = (jnp.full(1, x) for x in (0.4, 0.1, speed))
        joint = JointInput(*given, kp=jnp.full(1, KP), kd=jnp.full(1, KD))
        states, x = chain_step(model, states, joint, DT_S)
        _, rigid = chain_step((), (), joint, DT_S)
        assert (x == rigid) == (gap_rad == 0.0)
