"""An acceleration limit against the closed form of its trapezoids and triangles."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support import effects_rig as rig

from envs.actuator.effects.acceleration_limit import profiled

ACCELERATION, INF = 20.0, np.inf
ROUNDED = 5e-5
"""What thousands of additions in single precision lose [rad]."""


def profile_of(target, speed=None, acceleration=ACCELERATION, dt=rig.DT):
    """Commands behind a limit of the speed, if there is one, and of acceleration."""
    limit = {"acceleration_limit": {"acceleration_rad_s2": acceleration}}
    slew = {"slew_limit": {"speed_rad_s": speed}} if speed else {}
    return rig.run({**slew, **limit}, target, dt=dt)[2].command.astype(float)


def along(t_s, size, speed, acceleration):
    """A step from rest to rest: rises, stays at its top speed, and falls [rad]."""
    top = min(speed, np.sqrt(acceleration * size))
    rises_s, whole_s = top / acceleration, size / top + top / acceleration
    before, left_s = np.clip(t_s, 0.0, rises_s), np.clip(whole_s - t_s, 0.0, rises_s)
    stays_s = np.clip(t_s - rises_s, 0.0, whole_s - 2.0 * rises_s)
    falls = 0.5 * acceleration * (rises_s**2 - left_s**2)
    return 0.5 * acceleration * before**2 + top * stays_s + falls, whole_s


@pytest.mark.parametrize("dt", [rig.DT, 0.005])
@pytest.mark.parametrize("size", [0.02, 0.5, -1.3])
@pytest.mark.parametrize("speed", [0.5, 2.0, INF])
def test_a_step_takes_the_time_of_its_profile(size, speed, dt):
    """t = |d| / v + v / a, v at most √(a |d|), at any substep; never beyond."""
    steps = rig.jump(size, 3.5, dt)
    command = profile_of(steps, speed, dt=dt)
    # The target jumps at the second substep, and acts until its end.
    t_s = dt * np.arange(len(command))
    expected, whole_s = along(t_s, abs(size), speed, ACCELERATION)
    assert np.sign(size) * command == pytest.approx(expected, abs=ROUNDED)
    assert np.argmax(np.abs(command - size) < 1e-6) * dt == pytest.approx(
        whole_s, abs=dt + 3e-4
    )
    assert np.max(np.sign(size) * command) <= abs(size) + 1e-6
    without = along(t_s, abs(size), speed, 2.0 * ACCELERATION)[0]
    assert np.max(np.abs(without - expected)) > 2e-3


def test_an_absent_limit_is_none_to_the_bit():
    rng = np.random.default_rng(5)
    target = np.repeat(rng.uniform(-1.0, 1.0, 40), 20)
    path = {"lowpass_cutoff": {"cutoff_hz": 8.0}, "slew_limit": {"speed_rad_s": 4.0}}
    absent = {"acceleration_limit": {"acceleration_rad_s2": INF}}
    plain = rig.run(path, target)
    for a, b in zip(plain, rig.run({**path, **absent}, target), strict=True):
        pairs = zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True)
        assert all(np.array_equal(x, y) for x, y in pairs)
    there = {"acceleration_limit": {"acceleration_rad_s2": 100.0}}
    assert not np.array_equal(plain[0], rig.run({**path, **there}, target)[0])


def test_a_very_large_acceleration_leaves_the_limit_of_the_speed():
    target = np.concatenate([rig.jump(1.0, 0.4), rig.hold(-0.5, 0.4)])
    slow = rig.run({"slew_limit": {"speed_rad_s": 3.0}}, target)[2].command
    assert profile_of(target, 3.0, 1e6) == pytest.approx(slow, abs=ROUNDED)
    assert np.max(np.abs(profile_of(target, 3.0, 20.0) - slow)) > 0.2


def test_all_limits_hold_while_goals_change():
    """Speeds up and down and acceleration, whatever comes, and rest at the end."""
    rng = np.random.default_rng(7)
    target = np.repeat(rng.uniform(-1.0, 1.0, 60), rng.integers(5, 120, 60))
    target = np.concatenate([target, np.full(3000, target[-1])])
    limits = {
        "directional_slew": {"up_rad_s": 2.0, "down_rad_s": 3.5},
        "acceleration_limit": {"acceleration_rad_s2": ACCELERATION},
    }
    command = rig.run(limits, target)[2].command.astype(float)
    speed = np.diff(command) / rig.DT
    change = np.abs(np.diff(speed)) / rig.DT
    assert speed.max() == pytest.approx(2.0, abs=1e-3)
    assert speed.min() == pytest.approx(-3.5, abs=1e-3)
    assert change.max() < ACCELERATION + 0.5
    assert command[-1] == pytest.approx(target[-1], abs=1e-6)


def test_a_goal_that_turns_back_is_passed_by_the_way_of_braking():
    """x = w² / 2a beyond a goal at which it still has the speed w."""
    gap, speed = jnp.asarray(0.0), jnp.asarray(3.0)
    limits = (jnp.asarray(INF), jnp.asarray(INF))
    places = []
    for _ in range(400):
        gap, speed = profiled(gap, speed, limits, ACCELERATION, 1e-3)
        places.append(-float(gap))
    assert max(places) == pytest.approx(3.0**2 / (2.0 * ACCELERATION), rel=1e-4)
    assert min(places) > -1e-5
    # Braking, then a triangle back over w² / 2a.
    whole_s = 3.0 / ACCELERATION * (1.0 + np.sqrt(2.0))
    assert np.argmax(np.array(places[100:]) < 1e-6) + 100 == pytest.approx(
        1e3 * whole_s, abs=2.0
    )
    assert places[-1] == pytest.approx(0.0, abs=1e-6)


def test_another_unit_changes_nothing():
    target = rig.jump(1.0, 0.8)
    plain = profile_of(target, 2.0)
    for size in (1e-6, 1e6):
        scaled = profile_of(size * target, 2.0 * size, ACCELERATION * size)
        assert scaled / size == pytest.approx(plain, abs=ROUNDED)
