import os
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingers_deploy.errors import InputError
from fingers_robot.behaviour.command import (
    FRESH_S,
    CommandState,
    FixedCommand,
    Frame,
    command_step,
    rest_command,
    stick_command,
)
from fingers_robot.behaviour.heading import HeadingConfig, heading_step
from fingers_robot.behaviour.joystick import QUIET_S, Joystick
from fingers_robot.behaviour.upright import tilt_angle, upright_step

RANGES = ((0.0, 0.16), (-0.16, 0.16), (-0.45, 0.45))
DT = 0.02


def _drive(frames, seconds, state=None):
    """Steps with `frames(t)`; returns the commands."""
    state = state or CommandState(rest_command(RANGES), 0.0)
    start, values = state.t_s, []
    for k in range(1, round(seconds / DT) + 1):
        t = start + k * DT
        state, _ = command_step(state, frames(t), t, RANGES)
        values.append(state.value)
    return state, np.array(values)


def test_sticks_reach_the_ends_of_the_training_range_and_no_further():
    np.testing.assert_allclose(stick_command((1, 1, 1), RANGES), [0.16, 0.16, 0.45])
    np.testing.assert_allclose(stick_command((-1, -1, -1), RANGES), [0, -0.16, -0.45])
    np.testing.assert_allclose(stick_command((0.05, -0.05, 0), RANGES), 0)
    assert rest_command(((0.02, 0.1),))[0] == 0.02


def test_released_dead_man_stops_within_250_ms():
    state, _ = _drive(lambda t: Frame(t, (1, -1, 1), True), 1.0)
    np.testing.assert_allclose(state.value, [0.16, -0.16, 0.45])
    _, values = _drive(lambda t: Frame(t, (1, -1, 1), False), 0.26, state)
    assert np.abs(values[6]).max() > 0
    np.testing.assert_allclose(values[-1], 0, atol=1e-12)


def test_a_lost_gamepad_stops_within_250_ms_after_250_ms():
    state, _ = _drive(lambda t: Frame(t, (1, 1, 1), True), 1.0)
    last = Frame(state.t_s, (1, 1, 1), True)
    lost, values = _drive(lambda t: last, 0.6, state)
    moving = np.abs(values).max(axis=1) > 1e-12
    assert FRESH_S <= DT * moving.sum() <= FRESH_S + 0.26
    _, age = command_step(lost, last, lost.t_s + DT, RANGES)
    assert age == pytest.approx(0.62)


def test_without_any_frame_nothing_moves_and_the_age_is_infinite():
    state = CommandState(rest_command(RANGES), 0.0)
    state, age = command_step(state, None, 1.0, RANGES)
    assert np.isinf(age) and not state.value.any()


@settings(max_examples=200, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(-1, 1), st.booleans(), st.floats(0, 1), st.floats(0, 0.1)),
        max_size=30,
    )
)
def test_property_commands_stay_in_range_and_never_jump(script):
    state, t = CommandState(rest_command(RANGES), 0.0), 0.0
    low, high = np.array(RANGES).T
    for stick, held, age, dt in script:
        t += dt
        before = state.value
        frame = Frame(t - age, (stick,) * 3, held)
        state, _ = command_step(state, frame, t, RANGES)
        assert (state.value >= low - 1e-12).all() and (
            state.value <= high + 1e-12
        ).all()
        assert (np.abs(state.value - before) <= high * dt / 0.25 + 1e-12).all()


class Pad:
    """The other end of a joystick device."""

    def __init__(self, tmp_path):
        self.path = str(tmp_path / "js0")
        os.mkfifo(self.path)
        self.stick = None

    def open(self, **kwargs):
        self.stick = Joystick(self.path, **kwargs)
        self.end = os.open(self.path, os.O_WRONLY)
        return self.stick

    def event(self, value, kind, number):
        os.write(self.end, struct.pack("<IhBB", 0, value, kind, number))


@pytest.fixture
def pad(tmp_path):
    return Pad(tmp_path)


def test_joystick_reads_axes_and_dead_man(pad):
    stick = pad.open()
    pad.event(-32767, 0x82, 1)  # state at the start: stick 1 is pushed away
    pad.event(1, 0x01, 4)
    frame = stick.poll(5.0)
    assert frame.t_s == 5.0 and frame.deadman
    assert frame.sticks == pytest.approx((1.0, 0.0, 0.0))
    pad.event(0, 0x01, 4)
    assert not stick.poll(5.1).deadman
    stick.close()


def test_an_unplugged_joystick_grows_old(pad):
    stick = pad.open()
    pad.event(1, 0x01, 4)
    assert stick.poll(1.0).t_s == 1.0
    os.close(pad.end)
    assert stick.poll(1.2).t_s == 1.0 and stick.poll(9.0).t_s == 1.0
    stick.close()


def test_a_stick_held_out_without_any_change_grows_old_until_it_moves(pad):
    stick = pad.open()
    pad.event(1, 0x01, 4)
    pad.event(20000, 0x02, 0)
    assert stick.poll(1.0).t_s == 1.0
    assert stick.poll(1.0 + QUIET_S).t_s == 1.0 + QUIET_S
    assert stick.poll(1.1 + QUIET_S).t_s == 1.0 + QUIET_S
    pad.event(20010, 0x02, 0)
    assert stick.poll(9.0).t_s == 9.0
    pad.event(0, 0x02, 0)
    stick.poll(10.0)
    assert stick.poll(60.0).t_s == 60.0  # centred: nothing to lose
    stick.close()


def test_a_receiver_that_goes_away_with_the_link_needs_no_movement(pad):
    stick = pad.open(quiet_s=float("inf"))
    pad.event(32767, 0x02, 0)
    assert [stick.poll(t).t_s for t in (1.0, 60.0)] == [1.0, 60.0]
    stick.close()


def test_a_missing_joystick_is_refused(tmp_path):
    with pytest.raises(InputError, match="gamepad"):
        Joystick(str(tmp_path / "none"))


def test_a_fixed_command_is_always_fresh():
    assert FixedCommand((1.0,)).poll(7.0) == Frame(7.0, (1.0,), True)


HOLD = HeadingConfig(gain=1.0, offset_rad_s=0.1, low=-0.45, high=0.45)


def test_heading_hold_turns_back_with_its_offset_within_the_training_range():
    reference, rate = heading_step(0.0, 0.2, 0.0, HOLD)
    assert (reference, rate) == (0.0, pytest.approx(-0.1))
    assert heading_step(0.0, -3.0, 0.0, HOLD)[1] == 0.45
    assert heading_step(0.0, 2.0, 0.0, HOLD)[1] == -0.45
    # The short way round.
    assert heading_step(3.1, -3.1, 0.0, HOLD)[1] < 0.1


def test_heading_hold_follows_while_the_operator_turns():
    reference, rate = heading_step(0.0, 0.7, 0.3, HOLD)
    assert reference == 0.7 and rate == pytest.approx(0.4)
    assert heading_step(None, 1.2, 0.0, HOLD)[0] == 1.2


@pytest.mark.parametrize("drift", [-0.1, 0.0, 0.1])
def test_heading_hold_removes_a_drift_that_its_offset_knows(drift):
    config = HeadingConfig(1.0, -drift, -0.45, 0.45)
    psi, reference = 0.5, 0.0
    for _ in range(500):
        reference, rate = heading_step(reference, psi, 0.0, config)
        psi += (rate + drift) * DT
    assert abs(psi) < 0.01


@pytest.mark.parametrize(("gain", "beside_deg"), [(1.0, 5.7), (4.0, 1.4)])
def test_heading_hold_comes_to_rest_beside_its_heading(gain, beside_deg):
    """By drift / gain, also of a hand that turns 0.2 s later than it is asked to."""
    config = HeadingConfig(gain, 0.0, -0.45, 0.45)
    psi, turning = 0.5, 0.0
    for _ in range(500):
        _, rate = heading_step(0.0, psi, 0.0, config)
        turning += DT / 0.2 * (rate + 0.1 - turning)
        psi += turning * DT
    assert np.rad2deg(psi) == pytest.approx(beside_deg, abs=0.1)


def test_upright_needs_half_a_second_of_level_and_calm():
    since, times = np.inf, []
    for k in range(100):
        tilt, speed = np.deg2rad(9.0), 3.9
        if k == 40:
            tilt = np.deg2rad(10.1)
        if k == 60:
            speed = 4.1
        since, upright = upright_step(since, tilt, speed, k * DT)
        times.append(upright)
    assert times.index(True) == 25
    assert all(times[25:40]) and not any(times[40:86])
    assert all(times[86:])
    assert not upright_step(0.0, np.nan, 0.0, 9.0)[1]
    assert not upright_step(0.0, 0.0, np.nan, 9.0)[1]


def test_tilt_is_relative_to_the_stance():
    v = (0.8, 0.0, -0.6, 0.0)
    level = np.array([0.8, 0.0, 0.6, 0.0])
    assert tilt_angle(level, v) == pytest.approx(0, abs=1e-6)
    assert tilt_angle(np.array([1.0, 0, 0, 0]), v) == pytest.approx(2 * np.arccos(0.8))
