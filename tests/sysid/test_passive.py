"""What an MJCF file says beside masses is part of the simulation, or refused."""

import pytest

from envs.errors import InputError
from envs.physics.quiet_mujoco import mujoco
from sysid.drive import JointDrive, Nominal
from sysid.mechanism import model_mechanism

XML = """
<mujoco><worldbody><body><joint name="knee" {joint}/>
<inertial pos="0 0 -0.1" mass="0.2" diaginertia="1e-4 1e-4 1e-4"/></body>
<body {body}><joint name="other" pos="1 0 0"/>
<inertial pos="0 0 -0.1" mass="0.2" diaginertia="1e-4 1e-4 1e-4"/></body></worldbody>
{more}</mujoco>"""
KNEE = JointDrive(Nominal(5.0), Nominal(0.1, 0.1))


def drive_of(joint="", body="", more="", drive=KNEE):
    model = mujoco.MjModel.from_xml_string(
        XML.format(joint=joint, body=body, more=more)
    )
    return model_mechanism(model, {"knee": drive}, "knee.xml").drives["knee"]


def test_damping_friction_and_force_range_are_taken_over():
    motor = '<motor name="m" joint="knee" gear="2" ctrlrange="-1 1" forcerange="-3 3"/>'
    found = drive_of(
        'damping="0.02" frictionloss="0.3"', more=f"<actuator>{motor}</actuator>"
    )
    values = {e: next(iter(p.values())).value for e, p in found.effects.items()}
    expected = {"viscous_friction": 0.02, "coulomb_friction": 0.3, "torque_limit": 6.0}
    assert values == pytest.approx(expected)
    assert drive_of().effects == {}


def test_the_same_figure_may_stand_in_both():
    known = {"viscous_friction": {"damping_nms": Nominal(0.0202)}}
    both = JointDrive(KNEE.kp, KNEE.kd, effects=known)
    assert drive_of('damping="0.02"', drive=both).effects == known
    with pytest.raises(InputError, match=r"viscous_friction: found 0.03 here, 0.0202"):
        drive_of('damping="0.03"', drive=both)


@pytest.mark.parametrize(
    ("where", "text", "match"),
    [
        ("joint", 'stiffness="0.5"', "joint knee, stiffness: found 0.5"),
        ("body", 'gravcomp="1"', "gravcomp"),
        (
            "more",
            '<equality><joint joint1="knee" joint2="other"/></equality>',
            "1 constraint",
        ),
        (
            "more",
            '<tendon><fixed stiffness="2"><joint joint="knee" coef="1"/></fixed>'
            "</tendon>",
            "tendon",
        ),
        (
            "more",
            '<actuator><position name="a" joint="knee" kp="9"/></actuator>',
            "actuator a, kp: found 9 here, 5 in drive.yaml",
        ),
    ],
)
def test_what_is_not_simulated_is_refused_by_name(where, text, match):
    with pytest.raises(InputError, match=match):
        drive_of(**{where: text})


def test_an_actuator_with_the_gains_of_the_drive_is_fine():
    same = '<actuator><position joint="knee" kp="5" kv="0.1"/></actuator>'
    assert drive_of(more=same).kp.value == 5.0
