"""Figures of `drive.yaml`: a robot of any size, and what no robot has."""

import math
import re
from dataclasses import fields, replace
from pathlib import Path

import pytest

from envs.config.typed import from_dict
from envs.errors import InputError
from sysid.calibration.calibrate import calibrate
from sysid.drive import Cascade, DriveFile, JointDrive, Masses, Nominal
from sysid.excitation.check import fitting_plan
from sysid.excitation.plan import Limits, Schedule
from sysid.mechanism import hand_mechanism

GUIDE = Path(__file__).parents[2] / "docs/guides/diagnose.md"


def with_effect(effect, name, value):
    known = {effect: {name: Nominal(value)}}
    return JointDrive(Nominal(5.0), Nominal(0.1), effects=known)


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
def test_no_bound_of_the_hand_holds_elsewhere(size):
    for effect, name in {
        "coulomb_friction": "torque_nm",
        "viscous_friction": "damping_nms",
        "torque_limit": "limit_nm",
        "slew_limit": "speed_rad_s",
        "armature": "inertia_kgm2",
        "payload_mass": "mass_kg",
    }.items():
        assert with_effect(effect, name, size).parameter(effect, name, 0.0) == size


@pytest.mark.parametrize(
    ("effect", "name", "value"),
    [
        ("load_friction", "drive_share", 1.2),
        ("coulomb_friction", "torque_nm", -0.1),
        ("transport_delay", "delay_s", 19.0),
        ("lowpass_cutoff", "cutoff_hz", float("nan")),
        ("encoder_scale", "scale", 57.3),
    ],
)
def test_what_no_robot_has_is_refused_by_name(effect, name, value):
    with pytest.raises(InputError, match=rf"effects\.{effect}\.{name}: found"):
        with_effect(effect, name, value)


@pytest.mark.parametrize("gains", [(-1.0, 0.1), (1.0, -0.1), (float("nan"), 0.1)])
def test_gains_that_push_away_are_refused(gains):
    with pytest.raises(InputError, match="at least 0"):
        JointDrive(*map(Nominal, gains))


@pytest.mark.parametrize("known", ["both", "controller", "mechanics"])
def test_a_drive_without_a_gain_is_refused(known):
    with pytest.raises(InputError, match=r"kp: found 0\.0; valid: more than 0; any"):
        JointDrive(Nominal(0.0), Nominal(0.1), known=known)


@pytest.mark.parametrize("scale", [0.0, -0.5, math.nan, math.inf])
def test_an_effort_against_the_angle_is_refused(scale):
    with pytest.raises(InputError, match=r"effort_scale: found .* direction"):
        JointDrive(Nominal(5.0), Nominal(0.1), effort_scale=Nominal(scale))


@pytest.mark.parametrize("effect", ["floor_tilt", "joint_coupling", "finger_weakness"])
def test_effects_that_are_not_of_one_joint_are_refused(effect):
    with pytest.raises(InputError, match=f"found {effect}; valid: effects on"):
        JointDrive(Nominal(5.0), Nominal(0.1), effects={effect: {}})


def test_a_limit_of_nothing_is_refused():
    with pytest.raises(InputError, match=r"limit_nm: found 0\.0; valid: more than 0"):
        with_effect("torque_limit", "limit_nm", 0.0)
    assert with_effect("torque_limit", "limit_nm", math.inf).effects


def read(**joint):
    joint = {"kp": {"value": 5.0}, "kd": {"value": 0.1}, **joint}
    return from_dict(DriveFile, {"schema": 1, "joints": {"knee": joint}}, "drive.yaml")


def test_masses_have_a_tolerance():
    assert read().joints["knee"].masses == Masses(0.05)
    assert read(masses={}).joints["knee"].masses == Masses(0.05)
    assert read(masses={"tolerance": 0.5}).joints["knee"].masses == Masses(0.5)


@pytest.mark.parametrize(
    ("masses", "match"),
    [
        ("50 %", r"masses: found 50 %; valid: a mapping of tolerance$"),
        (0.5, r"masses: found 0\.5; valid: a mapping of tolerance$"),
        ({"value": 1.0}, r"masses\.value: found value; valid: one of tolerance$"),
        ({"tolerance": 50}, r"masses\.tolerance: found 50\.0; valid: .* >= 0 <= 10$"),
        ({"tolerance": -0.1}, r"masses\.tolerance: found -0\.1; valid: .* >= 0 <= 10$"),
        ({"tolerance": float("nan")}, r"masses\.tolerance: found nan; valid"),
        ({"tolerance": "half"}, r"masses\.tolerance: found 'half'; valid: a finite"),
    ],
)
def test_masses_of_another_form_are_refused(masses, match):
    with pytest.raises(
        InputError, match=r"drive\.yaml: joints\.knee\." + match
    ) as said:
        read(masses=masses)
    assert "\n" not in str(said.value)


LOOPS = {"k_pos": {"value": 12.0}, "k_vel": {"value": 0.3}}


def read_cascade(beside=None, **cascade):
    joint = {"cascade": {**LOOPS, **cascade}, **(beside or {})}
    return from_dict(DriveFile, {"schema": 1, "joints": {"knee": joint}}, "drive.yaml")


def test_a_cascade_is_read_in_the_place_of_two_gains():
    given = read_cascade(
        k_pos={"value": 12.0, "tolerance": 0.03},
        k_vel={"value": 0.3, "tolerance": 0.04, "free": True},
        k_int={"value": 6.0},
        speed_limit=2.0,
    )
    drive = given.joints["knee"]
    k_vel = Nominal(0.3, 0.04, True)
    assert drive.cascade == Cascade(Nominal(12.0, 0.03), k_vel, Nominal(6.0), 2.0)
    assert drive.kd == k_vel
    assert drive.kp.value == pytest.approx(3.6)
    assert drive.kp.tolerance == pytest.approx(0.05)
    assert drive.kp.free is True


def test_integral_and_speed_limit_may_be_absent():
    cascade = read_cascade().joints["knee"].cascade
    assert (cascade.k_int.value, cascade.speed_limit) == (0.0, math.inf)
    assert read().joints["knee"].cascade is None


def test_a_cascade_survives_changes_of_other_fields():
    drive = read_cascade().joints["knee"]
    assert replace(drive, effort="none").cascade == drive.cascade


def test_gains_beside_a_cascade_are_refused():
    for name in ("kp", "kd"):
        with pytest.raises(InputError, match=rf"{name}: found 5\.0; .*`cascade`"):
            read_cascade({name: {"value": 5.0}})


def test_a_joint_without_gains_is_refused():
    with pytest.raises(InputError, match=r"kp: .*or `cascade`"):
        from_dict(DriveFile, {"schema": 1, "joints": {"knee": {}}}, "drive.yaml")
    with pytest.raises(InputError, match=r"kd: .*or `cascade`"):
        JointDrive(Nominal(5.0))


@pytest.mark.parametrize(
    ("wrong", "match"),
    [
        ({"k_pos": {"value": 0.0}}, r"k_pos\.value: found 0\.0; valid: more than 0$"),
        ({"k_pos": {"value": -1.0}}, r"k_pos\.value: found -1\.0"),
        ({"k_vel": {"value": -0.3}}, r"k_vel\.value: found -0\.3"),
        ({"k_vel": {"value": math.nan}}, r"k_vel\.value: found nan"),
        ({"k_int": {"value": -6.0}}, r"k_int\.value: found -6\.0; valid: at least 0$"),
        (
            {"k_int": {"value": 0.0, "free": True}},
            r"k_int\.value: .* a search may begin",
        ),
        ({"speed_limit": 0.0}, r"speed_limit: found 0\.0; valid: more than 0$"),
        ({"speed_limit": -2.0}, r"speed_limit: found -2\.0"),
        ({"k_speed": {"value": 1.0}}, r"cascade\.k_speed: .*valid: one of"),
    ],
)
def test_a_cascade_that_no_drive_has_is_refused(wrong, match):
    with pytest.raises(InputError, match=match) as said:
        read_cascade(**wrong)
    assert "\n" not in str(said.value)


@pytest.mark.parametrize("missing", ["k_pos", "k_vel"])
def test_a_cascade_without_a_gain_is_refused(missing):
    loops = {name: gain for name, gain in LOOPS.items() if name != missing}
    file = {"schema": 1, "joints": {"knee": {"cascade": loops}}}
    with pytest.raises(InputError, match=rf"cascade\.{missing}"):
        from_dict(DriveFile, file, "drive.yaml")


def test_what_knows_two_gains_alone_refuses_a_cascade():
    mechanism = replace(
        hand_mechanism(), drives={"finger1_joint1": read_cascade().joints["knee"]}
    )
    with pytest.raises(InputError, match=r"finger1_joint1\.cascade: .*a calibration"):
        calibrate([], mechanism)
    with pytest.raises(InputError, match=r"finger1_joint1\.cascade: .*a plan"):
        fitting_plan(mechanism, [], Schedule(), Limits())


def test_the_guide_has_every_field_of_a_joint():
    table = GUIDE.read_text("utf-8").partition("| field of a joint |")[2]
    rows = re.findall(r"^\| (`[^|]+) \|", table.partition("\n\n")[0], re.MULTILINE)
    named = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    assert sorted(named) == sorted(field.name for field in fields(JointDrive))


def test_of_nothing_no_tolerance_is_assumed():
    """A twentieth in its own unit would be 50 ms of delay."""
    assert Nominal(0.004).tolerance == 0.05
    assert Nominal(0.0).tolerance == 0.0
    assert Nominal(0.0, 0.002).tolerance == 0.002
