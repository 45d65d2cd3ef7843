"""The settle ramp: smooth, over 1.5 s, and never faster than a policy may be."""

import dataclasses

import numpy as np
import pytest

from fingers_robot.behaviour.settle import settle_ramp

T0 = 12.34
TIMES = T0 + np.linspace(-0.1, 4.0, 2001)


@pytest.fixture
def goal(interface):
    return np.asarray(interface.initial_target_rad, np.float64)


def _track(ramp):
    return np.array([ramp.target(t) for t in TIMES])


def test_it_leads_from_the_targets_to_the_goal_at_rest_at_both_ends(interface, goal):
    start = goal + np.linspace(-0.8, 0.8, 20)
    ramp = settle_ramp(T0, start, goal, interface)
    assert ramp.duration_s == 1.5
    np.testing.assert_allclose(ramp.target(T0), start)
    np.testing.assert_allclose(ramp.target(T0 + 0.75), (start + goal) / 2)
    np.testing.assert_allclose(ramp.target(T0 + 1.5), goal)
    assert [ramp.over(T0 + s) for s in (0.0, 1.49, 1.51)] == [False, False, True]
    speed = np.gradient(_track(ramp), TIMES, axis=0)
    ends = [np.abs(TIMES - t).argmin() for t in (T0, T0 + 1.5)]
    assert np.abs(speed[ends]).max() < 0.01 < np.abs(speed).max()


def test_a_long_way_takes_longer_and_is_no_faster_than_a_policy(interface, goal):
    ramp = settle_ramp(T0, goal + 3.0, goal, interface)
    most = 0.8 * interface.action.scale_rad * interface.control_rate_hz
    fastest = np.abs(np.gradient(_track(ramp), TIMES, axis=0)).max()
    assert fastest == pytest.approx(most, rel=1e-3)
    slow = dataclasses.replace(interface.action, scale_rad=0.028)
    other = dataclasses.replace(interface, action=slow)
    longer = settle_ramp(T0, goal + 3.0, goal, other)
    assert longer.duration_s == pytest.approx(ramp.duration_s * 0.060 / 0.028)
