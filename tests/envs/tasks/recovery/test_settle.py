"""The end of a recovery is that of the shim: detector, ramp, and what they lead to."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.hand.hand_file import load_hand_file
from envs.hand.stance import stance_of
from envs.registry import make_batch
from envs.tasks.recovery.settle import Settle, action_toward, start_settling
from fingers_deploy.rotations import conjugate, gravity, multiply
from fingers_mjx.policy.interface import interface_of
from fingers_robot.behaviour.settle import settle_ramp
from fingers_robot.behaviour.upright import tilt_angle, upright_step

SEED = 20260124
DT_S = 0.02
STEPS = 260


@pytest.fixture(scope="module")
def interface():
    return interface_of(make_batch("recovery", 1))


@pytest.fixture(scope="module")
def settle():
    stance = stance_of(load_hand_file())
    return Settle(stance.target_rad, stance.q_off, DT_S, 0.060)


def motion(settle, away_rad):
    """Orientations, rates and proposed targets of a hand that comes up and wobbles."""
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    level = conjugate(settle.q_off)
    tilt = np.radians(np.concatenate([np.linspace(90, 11, 40), np.full(220, 4.0)]))
    tilt[58] = np.radians(10.5)  # breaks the dwell once
    axes = rng.normal(size=(STEPS, 3)) * [1, 1, 0]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    half = tilt[:, None] / 2
    turns = np.concatenate([np.cos(half), np.sin(half) * axes], axis=1)
    quats = np.array([multiply(turn, level) for turn in turns])
    gyro = rng.normal(0, 0.5, (STEPS, 3))
    gyro[66] = [0.0, 4.1, 0.0]  # and again
    walk = rng.uniform(-0.05, 0.05, (STEPS, 20)).cumsum(axis=0)
    return quats, gyro, np.array(settle.goal_rad) + walk + away_rad


def by_the_shim(interface, quats, gyro, proposed):
    since, ramp, targets, fired = np.inf, None, [], -1
    for k in range(STEPS):
        t = k * DT_S
        if ramp is not None:
            targets.append(ramp.target(t))
            continue
        targets.append(proposed[k])
        tilt = tilt_angle(quats[k], interface.v_quat_b)
        since, upright = upright_step(since, tilt, float(np.linalg.norm(gyro[k])), t)
        if upright:
            goal = interface.initial_target_rad
            ramp, fired = settle_ramp(t, proposed[k], goal, interface), k
    return fired, np.array(targets), np.inf if ramp is None else ramp.duration_s


def by_the_env(settle, quats, gyro, proposed):
    down = jnp.array([gravity(quat) for quat in quats])

    def step(settling, now):
        settling, target = settle.step(settling, *now)
        return settling, (settling.begun, target, settle.over(settling, now[3]))

    inputs = (down, jnp.array(gyro), jnp.array(proposed), jnp.arange(STEPS))
    _, (begun, targets, over) = jax.lax.scan(step, start_settling(20), inputs)
    return np.asarray(begun), np.asarray(targets), np.asarray(over)


@pytest.mark.parametrize("away_rad", [0.0, 2.5], ids=["near", "far"])
def test_detector_and_ramp_are_those_of_the_shim(settle, interface, away_rad):
    inputs = motion(settle, away_rad)
    fired, targets, duration_s = by_the_shim(interface, *inputs)
    begun, ours, over = by_the_env(settle, *inputs)
    assert fired == 67 + 25 == begun.argmax()
    np.testing.assert_allclose(ours, targets, atol=2e-6)
    end = fired + int(np.ceil(duration_s / DT_S - 1e-6))
    assert (over.argmax(), duration_s > 1.5) == (end, away_rad > 0)


def test_another_angle_of_the_detector_would_show(settle, interface):
    """Negative control."""
    quats, gyro, proposed = motion(settle, 0.0)
    leaning = dataclasses.replace(interface, v_quat_b=(1.0, 0.0, 0.0, 0.0))
    assert by_the_shim(leaning, quats, gyro, proposed)[0] != 92


def test_the_action_that_asks_for_a_motion_makes_it(interface):
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    before, by = rng.uniform(-1, 1, 20), rng.uniform(-0.05, 0.05, 20)
    action = action_toward(jnp.array(before), jnp.array(before + by), 0.060, 1.5)
    np.testing.assert_allclose(0.060 * np.tanh(action), by, atol=1e-6)
    most = action_toward(jnp.array(before), jnp.array(before + 1.0), 0.060, 1.5)
    np.testing.assert_allclose(most, 1.5, rtol=1e-5)
