"""Figures of `drive.yaml`: a robot of any size, and what no robot has."""

import re
from dataclasses import fields
from pathlib import Path

import pytest

from envs.config.typed import from_dict
from envs.errors import InputError
from sysid.drive import DriveFile, JointDrive, Masses, Nominal

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


def test_the_guide_has_every_field_of_a_joint():
    table = GUIDE.read_text("utf-8").partition("| field of a joint |")[2]
    rows = re.findall(r"^\| (`[^|]+) \|", table.partition("\n\n")[0], re.MULTILINE)
    named = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    assert sorted(named) == sorted(field.name for field in fields(JointDrive))
