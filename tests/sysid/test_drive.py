"""Figures of `drive.yaml`: a robot of any size, and what no robot has."""

import pytest

from envs.errors import InputError
from sysid.drive import JointDrive, Nominal


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
