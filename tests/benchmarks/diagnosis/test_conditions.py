"""Conditions of a hidden record: motions of people, other rigs, other units."""

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.diagnosis.hidden.believed import believed, true_parameters
from benchmarks.diagnosis.hidden.cases import drawn_case
from benchmarks.diagnosis.hidden.conditions import LEVELS, Conditions
from benchmarks.diagnosis.hidden.joint_drive import JointDrive
from benchmarks.diagnosis.hidden.motions import MOTIONS, user_motion
from benchmarks.diagnosis.hidden.stands import make_stand
from benchmarks.diagnosis.hidden.truth import Joint
from sysid.drive import Nominal

SHORT = Conditions(round_s=4.0)


def case_under(effects=(), **conditions):
    return drawn_case(3, effects, "medium", replace(SHORT, **conditions))


@pytest.mark.parametrize("name", MOTIONS)
def test_motions_begin_and_end_in_the_middle(name):
    middle, reach = np.array([0.3, -0.2]), np.array([0.5, 0.0])
    made = user_motion(np.random.default_rng(2), name, middle, reach, 100.0, 8.0)
    away = made.targets - middle
    assert away.shape == (800, 2)
    assert np.abs(away[[0, -1]]).max() < 1e-9
    assert 0.2 < np.abs(away[:, 0]).max() <= 0.5 + 1e-9
    assert not away[:, 1].any()


@pytest.mark.parametrize("rig", ["axis", "arm", "cascade"])
def test_rigs_follow_their_targets(rig):
    case = case_under(rig=rig, motion="sines", lowpass_hz=15.0)
    log = case.logs[0]
    for name in case.stand.names:
        cmd, pos = log.column(f"cmd.{name}"), log.column(f"pos.{name}")
        assert np.ptp(cmd) > 0.2
        assert np.sqrt(np.nanmean((pos - cmd)[200:] ** 2)) < 0.25 * np.ptp(cmd)
    gravity = rig != "axis"
    assert (np.nanstd(log.column(f"tau.{case.joint}")[-40:]) < 0.05) or gravity


def test_another_unit_of_force_changes_the_effort_alone():
    effects = ("coulomb_friction",)
    one, many = case_under(effects), case_under(effects, scale=100.0)
    name = one.joint
    for column in (f"cmd.{name}", f"pos.{name}"):
        same = [case.logs[0].column(column) for case in (one, many)]
        np.testing.assert_array_equal(*same)
    efforts = [case.logs[0].column(f"tau.{name}") for case in (one, many)]
    np.testing.assert_allclose(efforts[1], 100.0 * efforts[0])
    true = [true_parameters(case, effects[0])["torque_nm"] for case in (one, many)]
    assert true[1] == pytest.approx(100.0 * true[0])
    drives = [believed(case.stand).drives[name] for case in (one, many)]
    assert drives[1].kp.value == pytest.approx(100.0 * drives[0].kp.value)


def test_a_drive_without_low_pass_follows_at_once():
    drive = JointDrive(
        Joint(1.0, 0.1, 1e-3, 0.0, math.inf), [0.0, 0.1], [0.0, 1.0], 5e-4
    )
    drive.drive(0.0995, 0.0, 0.0, 1.0)
    assert drive.command == 0.0
    drive.drive(0.1, 0.0, 0.0, 1.0)
    assert drive.command == 1.0
    known = believed(case_under(lowpass_hz=math.inf).stand).drives["servo"].effects
    assert not {"lowpass_cutoff", "slew_limit"} & set(known)


def test_what_is_known_and_logged():
    case = case_under(effort=False, gains="unknown")
    assert not [name for name in case.logs[0].columns if name.startswith("tau.")]
    drive = believed(case.stand, effort=False).drives["servo"]
    assert (drive.kp.free, drive.effort) == (True, "none")
    assert believed(case_under().stand).drives["servo"].kp.free is False


def test_rounds_repeat_or_do_not():
    repeated = case_under(jitter=0.0)
    drawn = case_under(jitter=0.0, repeats=False)
    for case, same in ((repeated, True), (drawn, False)):
        noiseless = Conditions(round_s=4.0, repeats=same)
        stand = make_stand("pendulum", np.random.default_rng(1))
        rng = np.random.default_rng(2)
        once = noiseless.once(rng, stand)
        whole = noiseless.whole(once, rng, stand).targets
        rounds = whole.reshape(3, -1)
        assert np.array_equal(rounds[0], rounds[1]) == same
        assert len(case.logs[0]) > 2000


def test_the_clock_and_the_jitter_of_a_host():
    log = case_under(rate_hz=500.0, clock=2e-4, jitter=0.15).logs[0]
    row = np.round(log.t_s / 0.002 * 1.0002)
    period, start = np.polyfit(row, log.t_s, 1)
    assert period == pytest.approx(0.002 / 1.0002, rel=1e-5)
    late = log.t_s - start - period * row
    assert late.std() == pytest.approx(0.125 * 0.002, rel=0.1)  # cut off at 0.2


def test_a_cascade_is_known_by_its_own_gains_and_drawn_by_no_battery():
    """A further level would draw other records for every seed of the wide battery."""
    case = case_under(rig="cascade", lowpass_hz=15.0)
    joint = case.stand.mechanism.joints[0]
    drive = believed(case.stand).drives["shoulder"]
    assert drive.cascade.k_pos.value * drive.cascade.k_vel.value == joint.kp
    assert drive.cascade.k_int.value == joint.k_int
    assert drive.cascade.speed_limit == joint.ref_rad_s
    assert case.truth.joints[0].k_int != joint.k_int
    assert "cascade" not in LEVELS["rig"]


def test_a_drive_without_a_delay_is_known_to_have_none():
    """A twentieth of nothing is nothing: 50 ms would hide any latency in the drive."""
    for lag_s, tolerance in ((0.0, 0.0), (0.008, 0.05)):
        stand = make_stand("pendulum", np.random.default_rng(1))
        joint = replace(stand.mechanism.joints[0], delay_s=lag_s)
        stand = replace(stand, mechanism=stand.mechanism.with_joint(0, joint))
        drive = believed(stand).drives["servo"]
        assert drive.effects["transport_delay"]["delay_s"] == Nominal(lag_s, tolerance)
