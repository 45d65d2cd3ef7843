"""What an MJCF file says beside masses is part of the simulation, or refused."""

from pathlib import Path

import numpy as np
import pytest

from envs.errors import InputError
from envs.physics.quiet_mujoco import mujoco
from sysid.drive import JointDrive, Nominal
from sysid.mechanism import load_mjcf, model_mechanism

XML = """
<mujoco><worldbody><body><joint name="knee" {joint}/>
<inertial pos="0 0 -0.1" mass="0.2" diaginertia="1e-4 1e-4 1e-4"/>
<site name="toe"/></body>
<body {body}><joint name="other" pos="1 0 0"/>
<inertial pos="0 0 -0.1" mass="0.2" diaginertia="1e-4 1e-4 1e-4"/></body></worldbody>
{more}</mujoco>"""
HAND = Path(__file__).parents[2] / "examples/second_hand/small_hand.xml"
KNEE = JointDrive(Nominal(5.0), Nominal(0.1, 0.1))


def drive_of(joint="", body="", more="", drive=KNEE):
    model = mujoco.MjModel.from_xml_string(
        XML.format(joint=joint, body=body, more=more)
    )
    return model_mechanism(model, {"knee": drive}, "knee.xml").drives["knee"]


def actuators(*texts, **parts):
    return drive_of(more=f"<actuator>{''.join(texts)}</actuator>", **parts)


def limit_of(*texts, joint=""):
    effects = actuators(*texts, joint=joint).effects
    return effects["torque_limit"]["limit_nm"].value if effects else np.inf


def test_damping_friction_and_force_range_are_taken_over():
    motor = '<motor name="m" joint="knee" gear="2" forcerange="-3 3"/>'
    found = actuators(motor, joint='damping="0.02" frictionloss="0.3"')
    values = {e: next(iter(p.values())).value for e, p in found.effects.items()}
    expected = {"viscous_friction": 0.02, "coulomb_friction": 0.3, "torque_limit": 6.0}
    assert values == pytest.approx(expected)
    assert drive_of().effects == {}


ONE = '<motor joint="knee" forcerange="-1 1"/>'


@pytest.mark.parametrize(
    ("texts", "joint", "limit"),
    [
        ((ONE, ONE), "", 2.0),
        ((ONE, '<motor joint="knee"/>'), "", np.inf),
        ((ONE, '<motor joint="other" forcerange="-1 1"/>'), "", 1.0),
        ((ONE, ONE), 'actuatorfrcrange="-1.5 1.5"', 1.5),
        ((ONE,), 'actuatorfrcrange="-1.5 1.5"', 1.0),
        ((), 'actuatorfrcrange="-0.7 0.7"', 0.7),
        (('<motor jointinparent="knee" forcerange="-1 1"/>',), "", 1.0),
        (('<motor joint="knee" gear="-3" ctrlrange="-1 1"/>',), "", 3.0),
        (('<general joint="knee" gainprm="2" ctrlrange="-1 1"/>',), "", 2.0),
        (('<motor joint="knee" ctrlrange="-4 4" forcerange="-1 1"/>',), "", 1.0),
        (('<position joint="knee" kp="5" ctrlrange="-1 2"/>',), "", np.inf),
    ],
)
def test_limits_of_all_actuators_are_the_torque_limit(texts, joint, limit):
    assert limit_of(*texts, joint=joint) == pytest.approx(limit)


def test_an_effect_without_its_figure_takes_that_of_the_file():
    empty = JointDrive(KNEE.kp, KNEE.kd, effects={"coulomb_friction": {}})
    found = drive_of('frictionloss="0.3"', drive=empty).effects["coulomb_friction"]
    assert found["torque_nm"].value == 0.3


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
        ("body", 'gravcomp="1"', "body number 2, gravcomp: found 1"),
        ("joint", 'stiffness="0 5"', "joint knee, stiffness, higher orders: found 5 0"),
        ("joint", 'damping="0 2"', "joint knee, damping, higher orders: found 2 0"),
        ("joint", 'actuatorfrcrange="-3 1"', "knee, actuatorfrcrange: found -3 1"),
        ("more", '<option density="1.2"/>', "option density: found 1.2"),
        ("more", '<option viscosity="1"/>', "option viscosity: found 1"),
        ("more", '<option wind="0 2 0"/>', "option wind: found 0 2 0"),
        (
            "more",
            '<option actuatorgroupdisable="1"/>',
            "option actuatorgroupdisable: found 2",
        ),
        (
            "more",
            '<option><flag gravity="disable"/></option>',
            "flag gravity: found disable",
        ),
        (
            "more",
            '<option><flag frictionloss="disable"/></option>',
            "flag frictionloss: found disable",
        ),
        (
            "more",
            '<equality><joint joint1="knee" joint2="other"/></equality>',
            "equality: found 1; ",
        ),
        (
            "more",
            '<tendon><fixed stiffness="2"><joint joint="knee" coef="1"/></fixed>'
            "</tendon>",
            "tendon number 0, stiffness: found 2; ",
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


FIXED = '<tendon><fixed name="t" {}><joint joint="{}" coef="1"/></fixed></tendon>'


@pytest.mark.parametrize(
    ("acts", "match"),
    [
        ('damping="0 2"', "tendon t, dampingpoly: found 2 0"),
        ('stiffness="0 2"', "tendon t, stiffnesspoly: found 2 0"),
        ('armature="0.1"', "tendon t, armature: found 0.1"),
        ('range="-1 1"', "tendon t, limited: found 1"),
    ],
)
def test_a_tendon_that_acts_is_refused(acts, match):
    drive_of(more=FIXED.format("", "knee"))
    with pytest.raises(InputError, match=match):
        drive_of(more=FIXED.format(acts, "knee"))


SERVO = 'position name="a" joint="knee" kp="5"'
GENERAL = 'general name="a" joint="knee" biastype="affine"'


@pytest.mark.parametrize(
    ("text", "match"),
    [
        (f'{SERVO} timeconst="0.1"', "dyntype: found filterexact"),
        (f'{SERVO} delay="0.01" nsample="3"', "delay: found 0.01"),
        (f'{SERVO} damping="0.2"', "damping: found 0.2"),
        (f'{SERVO} damping="0 0.2"', "dampingpoly: found 0.2 0"),
        (f'{SERVO} armature="0.1"', "armature: found 0.1"),
        (f'{SERVO} forcerange="-3 1"', "forcerange: found -3 1"),
        ('motor name="a" joint="knee" forcerange="-3 0"', "forcerange: found -3 0"),
        ('motor name="a" joint="knee" ctrlrange="0 1"', "ctrlrange: found 0 1"),
        ('velocity name="a" joint="knee" kv="2"', "biasprm: .* a bias of 0 0 -2"),
        ('intvelocity name="a" joint="knee" actrange="0 1"', "dyntype: found integr"),
        ('damper name="a" joint="knee" ctrlrange="0 1"', "gaintype: found affine"),
        ('cylinder name="a" joint="knee"', "dyntype: found filter;"),
        ('muscle name="a" joint="knee" lengthrange="0 1"', "dyntype: found muscle"),
        (
            'dcmotor name="a" joint="knee" motorconst="0.1" resistance="1"',
            "dyntype: found dcmotor",
        ),
        ('pid name="a" joint="knee" kp="5"', "gaintype: found pid"),
        (f'{GENERAL} gainprm="5" biasprm="1 -5"', "biasprm: .* a bias of 1 -5 0"),
        (f'{GENERAL} gainprm="4" biasprm="0 -5"', "biasprm: found a gain of 4 and"),
        (f'{GENERAL} gainprm="-5" biasprm="0 5"', "biasprm: found a gain of -5 and"),
        ('motor name="a" tendon="t"', "trntype: found tendon"),
        ('motor name="a" site="toe" gear="0 0 0 1 1 1"', "trntype: found site"),
        ('adhesion name="a" body="foot" ctrlrange="0 1"', "trntype: found body"),
    ],
)
def test_an_actuator_of_another_kind_is_refused(text, match):
    acting = f"<actuator><{text}/></actuator>"
    with pytest.raises(InputError, match=f"knee.xml: actuator a, {match}"):
        drive_of(body='name="foot"', more=FIXED.format("", "knee") + acting)


def test_an_actuator_without_a_name_is_refused_by_its_number():
    with pytest.raises(InputError, match="actuator number 1, dyntype"):
        actuators(
            '<motor joint="other"/>', '<position joint="knee" kp="5" timeconst="1"/>'
        )


def test_a_servo_beside_another_actuator_is_refused():
    with pytest.raises(InputError, match="joint knee, actuators: found a, number 1"):
        actuators(f"<{SERVO}/>", ONE)


def test_what_moves_other_joints_does_not_count():
    muscle = '<muscle tendon="t" lengthrange="0 1"/>'
    acting = f'<actuator><velocity joint="other" kv="2"/>{muscle}</actuator>'
    assert drive_of(more=FIXED.format("", "other") + acting).effects == {}


@pytest.mark.parametrize(
    ("ends", "gear", "fine"),
    [
        ("-1.57 1.57", "1", True),
        ("-4 4", "-2", True),
        ("-3 3", "-2", False),
        ("-1 2", "1", False),
        ("-2 1", "1", False),
    ],
)
def test_targets_of_a_servo_reach_the_ends_of_its_joint(ends, gear, fine):
    gains = f'kp="{5 / float(gear) ** 2}" gear="{gear}"'
    servo = f'<position name="a" joint="knee" {gains} ctrlrange="{ends}"/>'
    if fine:
        assert actuators(servo, joint='range="-90 90"').effects == {}
        return
    with pytest.raises(
        InputError, match=r"actuator a, ctrlrange: .* -1\.5708 to 1\.5708"
    ):
        actuators(servo, joint='range="-90 90"')


def test_joints_without_a_name_stand():
    free = "<body><freejoint/><geom size='.1'/><body><joint/><geom size='.1'/>{}</body>"
    knee = '<body><joint name="knee"/><geom size=".1"/></body>'
    text = f"<mujoco><worldbody>{free}</body></worldbody></mujoco>"
    model = mujoco.MjModel.from_xml_string(text.format(knee))
    assert model_mechanism(model, {"*": KNEE}).joints == ("knee",)
    model = mujoco.MjModel.from_xml_string(text.format(""))
    with pytest.raises(InputError, match="2 joints, none of them a hinge or slide"):
        model_mechanism(model, {"*": KNEE}, "knee.xml")


def test_the_hand_of_the_examples_is_a_mechanism():
    model = load_mjcf(HAND)
    four = JointDrive(Nominal(4.0), Nominal(0.08))
    drives = model_mechanism(model, {"*": four}, HAND).drives
    assert len(drives) == 12
    assert {d.effects["torque_limit"]["limit_nm"].value for d in drives.values()} == {
        0.8
    }


def test_an_actuator_with_the_gains_of_the_drive_is_fine():
    same = '<actuator><position joint="knee" kp="5" kv="0.1"/></actuator>'
    assert drive_of(more=same).kp.value == 5.0
