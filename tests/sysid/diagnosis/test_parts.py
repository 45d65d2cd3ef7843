"""Grid, coordinates and folds of the diagnosis."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import lfilter
from support.plain_servo import steps_taken

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.cases import draw_case
from envs.actuator.catalogue import CATALOGUE
from envs.errors import InputError
from envs.physics.quiet_mujoco import mujoco
from sysid.diagnosis.diagnose import diagnose, problem_of
from sysid.diagnosis.fits.space import make_space
from sysid.diagnosis.measured.resampling import (
    error_between,
    held_targets,
    read_between,
    shares,
    smoothed,
)
from sysid.diagnosis.measured.segments import grid_step_s, pieces_of
from sysid.diagnosis.replay.command import WITHIN, command_path
from sysid.diagnosis.replay.link import Link, LinkForce, link_step
from sysid.diagnosis.replay.noise import spring_noise_gain
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.settling import settled
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import hand_mechanism, model_mechanism

STAND = """
<mujoco><worldbody><body><joint name="knee" axis="0 1 0"/>
<inertial pos="0 0 -0.1" mass="0.2" diaginertia="1e-4 1e-4 1e-4"/>
</body></worldbody></mujoco>"""

DRIVE = JointDrive(Nominal(5.0), Nominal(0.1, 0.1))


def stand(**drive):
    model = mujoco.MjModel.from_xml_string(STAND)
    fields = {"kp": Nominal(5.0), "kd": Nominal(0.1, 0.1), **drive}
    return model_mechanism(model, {"knee": JointDrive(**fields)})


def log_of(t_s, cmd, pos, **columns):
    named = {"cmd.knee": cmd, "pos.knee": pos}
    named |= {f"{k}.knee": v for k, v in columns.items()}
    return make_log(("knee",), t_s, named)


def test_smoothing_keeps_lines_and_derives_waves():
    x = np.arange(400.0)
    assert smoothed(3.0 - 0.5 * x, 2.0) == pytest.approx(3.0 - 0.5 * x, abs=1e-9)
    assert smoothed(0.5 * x, 2.0, 1) == pytest.approx(0.5, abs=1e-9)
    w = 2.0 * np.pi / 40.0
    gain = np.exp(-0.5 * (2.0 * w) ** 2)
    slope = smoothed(np.sin(w * x), 2.0, 1)[100:300]
    assert slope == pytest.approx(gain * w * np.cos(w * x)[100:300], abs=1e-4)


def test_rows_that_jitter_are_read_between_on_a_curve():
    """A straight line errs by a h² / 8 there: 4 mrad at 350 rad/s²."""
    t_s = 0.01 * np.arange(400) + np.random.default_rng(0).uniform(-1.5e-3, 1.5e-3, 400)
    grid = 0.01 * np.arange(5, 395)
    wave, truth = (np.sin(2 * np.pi * 3.0 * t) for t in (t_s, grid))
    error = np.abs(read_between(t_s, wave, grid, 0.01) - truth).max()
    assert error < 1e-5 < 2e-3 < np.abs(np.interp(grid, t_s, wave) - truth).max()


def test_the_error_between_rows_is_known_where_a_servo_takes_a_step():
    rng = np.random.default_rng(0)
    t_s = 0.02 * np.arange(3000) + rng.uniform(-4e-3, 4e-3, 3000)
    grid = 0.02 * np.arange(5, 2995)
    error = np.abs(read_between(t_s, steps_taken(t_s), grid, 0.02) - steps_taken(grid))
    said = error_between(t_s, steps_taken(t_s), grid, 0.02)
    large = error > 1e-3
    assert large.sum() > 50
    ratio = np.sqrt(np.mean(said[large] ** 2) / np.mean(error[large] ** 2))
    assert 0.5 < ratio < 2.0
    assert np.mean(error[large] < 3.0 * said[large]) > 0.9


def test_between_rows_of_a_smooth_motion_hardly_anything_is_lost():
    t_s = 0.01 * np.arange(400) + np.random.default_rng(0).uniform(-1.5e-3, 1.5e-3, 400)
    said = error_between(t_s, np.sin(2 * np.pi * t_s), 0.01 * np.arange(5, 395), 0.01)
    assert said.max() < 1e-5


def test_at_the_rows_themselves_nothing_is_lost():
    t_s = 0.02 * np.arange(300)
    assert not error_between(t_s, steps_taken(t_s), t_s, 0.02).any()


def test_a_gap_is_bridged_by_a_straight_line():
    """And bends nothing beside it."""
    t_s = np.delete(0.01 * np.arange(100), np.arange(40, 60))
    grid = 0.005 * np.arange(198)
    read = read_between(t_s, np.sin(20.0 * t_s), grid, 0.01)
    gap = (grid > 0.391) & (grid < 0.599)
    line = np.interp(grid, t_s, np.sin(20.0 * t_s))
    assert read[gap] == pytest.approx(line[gap], abs=1e-12)
    assert np.abs(read - np.sin(20.0 * grid))[~gap].max() < 1e-4


def test_two_readings_at_almost_one_time_throw_no_curve():
    """A burst of messages: one count of an encoder within a microsecond."""
    t_s = np.array([0.0, 0.01, 0.02, 0.020001, 0.03, 0.04, 0.05])
    x = np.array([0.0, 0.0, 0.0, 1e-3, 1e-3, 1e-3, 1e-3])
    read = read_between(t_s, x, np.linspace(0.0, 0.05, 101), 0.01)
    assert np.abs(read - 5e-4).max() < 7e-4


def test_pieces_end_where_the_clock_jumps():
    t_s = np.concatenate([np.arange(0.0, 4.0, 0.005), np.arange(4.5, 7.0, 0.005)])
    log = log_of(t_s, np.sin(t_s), np.sin(t_s))
    step = grid_step_s([log], ["knee"])
    first, second = pieces_of(log, 0, {"knee": DRIVE}, step)
    assert first.t_s[-1] < 4.0 < second.t_s[0]
    assert second.pos[10:-10, 0] == pytest.approx(np.sin(second.t_s)[10:-10], abs=1e-4)
    assert second.vel[20:-20, 0] == pytest.approx(np.cos(second.t_s)[20:-20], abs=1e-3)
    assert np.all(np.isnan(first.effort))


def test_gravity_of_the_stand():
    """m (a × r) · g = −m g l sin q for a weight that hangs."""
    t_s = np.arange(0.0, 4.0, 0.005)
    q = 0.5 * np.sin(t_s)
    track = all_tracks([log_of(t_s, q, q)], stand())[0].track
    torque = np.sum(np.asarray(track.moment) * np.asarray(track.gravity), -1)[:, 0]
    expected = -0.2 * 9.81 * 0.1 * np.sin(np.asarray(track.pos)[:, 0])
    assert torque == pytest.approx(expected, abs=1e-5)
    assert np.asarray(track.inertia) == pytest.approx(2e-3 + 1e-4, rel=1e-4)


def test_records_of_different_rates():
    logs = []
    for rate_hz in (100.0, 250.0):
        t_s = np.arange(0.0, 4.0, 1.0 / rate_hz)
        logs.append(log_of(t_s, np.sin(t_s), np.sin(t_s)))
    track = all_tracks(logs, stand())[0].track
    assert track.held.shape == track.sent.shape
    assert np.asarray(track.cmd)[:, 0] == pytest.approx(
        np.asarray(track.cmd)[:, 1], abs=0.02
    )


def test_a_servo_that_is_off_has_no_target():
    """Angles go on without targets: those do not count; a message's target holds."""
    t_s = np.arange(0.0, 4.0, 0.005)
    cmd = np.where(t_s < 2.0, np.sin(t_s), np.nan)
    off = pieces_of(log_of(t_s, cmd, np.sin(t_s)), 0, {"knee": DRIVE}, 0.005)[0]
    assert off.valid[50:390, 0].all()
    assert not off.valid[402:, 0].any()
    rows = np.repeat(t_s, 2)
    sent = np.where(np.arange(len(rows)) % 2 == 0, np.repeat(cmd, 2), np.nan)
    read = np.where(np.arange(len(rows)) % 2 == 1, np.sin(rows), np.nan)
    on = pieces_of(log_of(rows, sent, read), 0, {"knee": DRIVE}, 0.005)[0]
    assert on.valid[402:780, 0].all()


def test_a_target_between_rows_acts_until_it_is_reached():
    """Rows are missing in which the target jumps by 1 rad, at 2 rad/s at most."""
    t_s = np.delete(np.arange(0.0, 6.0, 0.005), slice(400, 410))
    log = log_of(t_s, np.where(t_s < 2.02, 0.0, 1.0), np.sin(t_s))
    slow = replace(DRIVE, effects={"slew_limit": {"speed_rad_s": Nominal(2.0)}})
    for drive, until_s in ((DRIVE, 2.3), (slow, 2.8)):
        valid = pieces_of(log, 0, {"knee": drive}, 0.005)[0].valid[:, 0]
        assert not valid[402 : int(until_s / 0.005) - 1].any()
        assert valid[int(until_s / 0.005) + 2 : -2].all()


def test_targets_that_are_held():
    """The last ones before the end of a step, and how long each of them was held."""
    t_s, values = np.array([0.0, 0.004, 0.011]), np.array([1.0, 2.0, 3.0])
    held, sent = held_targets(t_s, values, np.array([0.0, 0.01, 0.02]), 3)
    assert held[2] == pytest.approx([1.0, 2.0, 3.0])
    assert sent[2, 1:] == pytest.approx([-1.6, -0.9])
    assert shares(sent)[1] == pytest.approx([0.0, 0.4, 0.6])
    assert shares(sent)[2] == pytest.approx([0.0, 0.1, 0.9])


def test_a_command_between_its_targets():
    """Sampled, a saw behind a low-pass is met at one place; its ripple is the rest."""
    dt, cutoff, rate, delay = 0.005, 15.0, 6.0, 0.0155
    fine = np.arange(0.0, 2.0, 1e-5)
    arrived = rate * dt * np.floor((fine - delay) / dt + 1e-9)
    lag = 1.0 / (2.0 * np.pi * cutoff)
    exact = lfilter(
        *([1.0 - np.exp(-1e-5 / lag)], [1.0, -np.exp(-1e-5 / lag)]), arrived
    )
    grid = np.arange(0.0, 2.0, dt)
    held, sent = held_targets(grid, rate * grid, grid, 4)
    params = {
        "transport_delay": {"delay_s": jnp.array([delay])},
        "lowpass_cutoff": {"cutoff_hz": jnp.array([cutoff])},
    }
    made = command_path(
        jnp.array(held[..., None]), jnp.array(sent[..., None]), params, dt
    )
    path, ripple = (np.asarray(x)[:, 0, 0] for x in (made.path, made.ripple))
    rows = slice(150, 350)
    every = round(dt / 1e-5)
    sampled = np.asarray(exact)[::every]
    assert path[rows] == pytest.approx(sampled[rows], abs=1.2e-4)
    mean = np.convolve(exact, np.ones(every) / every, "same")[::every]
    assert ripple[rows] == pytest.approx((mean - sampled)[rows], abs=1.2e-4)
    assert np.max(np.abs(ripple[rows])) > 5e-4
    for k, time in enumerate(WITHIN):
        still = np.asarray(made.ahead)[:, k, 0, 0]
        there = np.asarray(exact)[every - round((1.0 - time) * every) :: every]
        assert still[rows] == pytest.approx(
            (sampled[1:] - there[:-1])[149:349], abs=2e-4
        )


def test_coordinates_and_identity():
    """At the base every effect of the stand vanishes, and values come back."""
    t_s = np.arange(0.0, 4.0, 0.005)
    q = 0.5 * np.sin(t_s)
    mechanism = stand(effects={"slew_limit": {"speed_rad_s": Nominal(3.0)}})
    track = all_tracks([log_of(t_s, q, q)], mechanism)[0]
    space = make_space(track, mechanism.drives["knee"], {"others_nm": True})
    params, _ = space.values(space.nominal[None])
    for effect in space.effects:
        for name, value in CATALOGUE[effect].identity().items():
            if CATALOGUE[effect].parameters[name].identity is not None:
                expected = 3.0 if effect == "slew_limit" else value
                assert params[effect][name][0] == pytest.approx(expected)
    for slot in space.slots:
        for u in slot.starts:
            value = float(slot.value(np.array(u)))
            assert slot.coordinate(value) == pytest.approx(u, abs=1e-9)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"t_s": np.arange(20) * 0.005}, "1.5 s"),
        ({"t_s": np.random.default_rng(1).permutation(600) * 0.005}, "into the past"),
    ],
)
def test_records_that_are_refused(change, match):
    t_s = change["t_s"]
    with pytest.raises(InputError, match=match):
        diagnose([log_of(t_s, np.sin(t_s), np.sin(t_s))], stand())


def test_a_torque_that_acts_late_is_no_friction():
    """A servo holds its torque for a cycle, which `hold_s` makes good."""
    t_s, age = np.arange(0.0, 6.0, 0.005), 5e-4
    q = 0.3 * np.sin(2.0 * np.pi * 3.0 * t_s)
    # The torque that is logged acts so much later.
    angle = 0.3 * np.sin(2.0 * np.pi * 3.0 * (t_s + age))
    acc = -((2.0 * np.pi * 3.0) ** 2) * angle
    tau = 2.1e-3 * acc + 0.2 * 9.81 * 0.1 * np.sin(q)
    mechanism, log = stand(known="mechanics"), log_of(t_s, q, q, tau=tau)
    problem = problem_of(all_tracks([log], mechanism)[0], [log], mechanism, False)
    theta = np.stack([problem.space.nominal] * 2)
    names = [s.name for s in problem.space.slots]
    theta[1, names.index("hold_s")] = age / 1e-3
    plain, held = np.sqrt(np.mean(problem.raw(theta, weigh=False)[:, 1] ** 2, (1, 2)))
    assert held < 0.35 * plain


def test_an_angle_that_is_read_too_small_is_not_late():
    """Behind an encoder of scale 0.6 a motion at 2 Hz, half a radian wide."""
    t_s, scale, rate = np.arange(0.0, 6.0, 0.005), 0.6, 2.0 * np.pi * 2.0
    q = 0.5 * np.sin(rate * t_s)
    tau = -2.1e-3 * rate**2 * q + 0.2 * 9.81 * 0.1 * np.sin(q)
    mechanism, log = stand(known="mechanics"), log_of(t_s, q, scale * q, tau=tau)
    problem = problem_of(all_tracks([log], mechanism)[0], [log], mechanism, False)
    theta = np.stack([problem.space.nominal] * 2)
    (at,) = problem.space.of("encoder_scale")
    theta[1, at] = problem.space.slots[at].coordinate(scale)
    plain, scaled = np.sqrt(np.mean(problem.raw(theta, weigh=False)[:, 1] ** 2, (1, 2)))
    assert scaled < 0.01 * plain


def test_a_fit_leaves_the_kink_of_a_delay():
    """Believed are four steps of the grid, where targets arrive as readings are taken.

    On this record a fit from there alone stays there, and the rest looks like latency.
    """
    case = draw_case(707 * 100_003 + 11, kind="joint")
    mechanism, logs = believed(case.stand), list(case.logs)
    track = next(t for t in all_tracks(logs, mechanism) if t.joint == case.joint)
    problem = problem_of(track, logs, mechanism, False)
    (at,) = problem.space.of("transport_delay")
    slot = problem.space.slots[at]
    believed_s = slot.value(problem.space.nominal[at])
    assert believed_s == pytest.approx(4.0 * track.dt, rel=1e-4)
    delay_s = case.truth.joints[case.stand.names.index(case.joint)].delay_s
    found = slot.value(settled(problem)[1].fit.theta[at])
    assert found == pytest.approx(delay_s, abs=3e-4)
    assert abs(4.0 * track.dt - delay_s) > 6e-4


def test_joints_that_the_mechanism_lacks():
    t_s = np.arange(0.0, 4.0, 0.005)
    with pytest.raises(InputError, match="knee"):
        diagnose([log_of(t_s, np.sin(t_s), np.sin(t_s))], hand_mechanism())


def test_a_joint_that_stands():
    t_s = np.arange(0.0, 4.0, 0.005)
    found = diagnose([log_of(t_s, 0.0 * t_s, 0.0 * t_s)], stand())
    assert found.verdict == "not_observable"
    assert not found.causes
    assert "coulomb_friction" in found.not_observable
    assert found.next_experiment


def test_a_link_flies_through_its_play():
    """Under a torque c t it goes c t³ / 6 J, and stops at the wall."""
    dt, inertia, rise, gap = 0.005, 1e-3, 0.5, 0.5
    one = jnp.ones((1, 1))
    state = (-0.5 * gap * one, 0.0 * one)
    link, torque = Link(inertia * one, gap * one, 0.0 * one), 0.0
    for k in range(1, 51):
        force = rise * k * dt * one
        state, pull = link_step(state, LinkForce(force, force, force), link, dt)
        torque = float((pull.smoothed + pull.sharp)[0, 0])
        if k == 20:
            way = float(state[0][0, 0]) + 0.5 * gap
            assert way == pytest.approx(rise * (k * dt) ** 3 / 6.0 / inertia, rel=0.01)
            assert torque == pytest.approx(0.0, abs=1e-6)
    assert float(state[0][0, 0]) == pytest.approx(0.5 * gap)
    assert torque == pytest.approx(rise * 50 * dt)


def test_a_link_rests_at_a_wall_while_the_motor_pushes_it():
    """Noise of the motor's acceleration does not throw it off."""
    one = jnp.ones((1, 1))
    state, noisy, pushed = (0.01 * one, 0.0 * one), -0.3 * one, 0.1 * one
    link = Link(1e-3 * one, 0.02 * one, 0.0 * one)
    state, pull = link_step(state, LinkForce(pushed, noisy, pushed), link, 0.005)
    assert float(state[1][0, 0]) == 0.0
    assert float((pull.smoothed + pull.sharp)[0, 0]) == pytest.approx(0.1)
    state, _ = link_step(state, LinkForce(pushed, noisy, -pushed), link, 0.005)
    assert float(state[1][0, 0]) == pytest.approx(-0.3 / 1e-3 * 0.005)


def test_a_spring_amplifies_the_noise_of_its_motor():
    link, rotor = 2e-3 * jnp.ones((1, 3)), 1e-3 * jnp.ones((1, 3))
    soft = jnp.array([[0.0, 1e-6, 0.05]])
    gain = spring_noise_gain(link, rotor, soft, jnp.array(1e-4), jnp.array(1e-3), 0.02)
    assert float(gain[0, 0]) == 1.0
    assert float(gain[0, 1]) == pytest.approx(1.0, abs=0.01)
    assert float(gain[0, 2]) > 1.3
