"""Joints that feel one body have one cause with one size."""

import numpy as np
import pytest

from envs.physics.quiet_mujoco import mujoco
from sysid.diagnosis.verdict.shared import combined, disagree, sharing
from sysid.drive import JointDrive, Nominal
from sysid.mechanism import hand_mechanism, model_mechanism
from sysid.result import Estimate

TREE = """
<mujoco><worldbody><body>
<joint name="turn" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<body><joint name="left" axis="0 1 0"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<body><joint name="left_tip" axis="0 1 0"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></body>
<body><joint name="right" axis="0 1 0"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>
</body></worldbody></mujoco>"""


def tree():
    drive = JointDrive(Nominal(1.0), Nominal(1.0))
    return model_mechanism(mujoco.MjModel.from_xml_string(TREE), {"*": drive})


def mass(value, sd, half_width=2.5):
    ends = (value - half_width * sd, value + half_width * sd)
    return {"mass_kg": Estimate(value, *ends, "kg")}


def test_a_load_is_felt_along_its_chain():
    joints = ("turn", "left", "left_tip", "right")
    groups = sharing("payload_mass", ("left", "left_tip", "right"), tree())
    assert groups == [("left", "left_tip"), ("right",)]
    assert sharing("mount_tilt", joints, tree()) == [joints]
    assert sharing("backlash", joints, tree()) == [(j,) for j in joints]


def test_fingers_of_a_hand_have_loads_of_their_own():
    joints = ("finger1_joint1", "finger1_joint2")
    assert sharing("payload_mass", joints, hand_mechanism()) == [(j,) for j in joints]


def test_the_size_is_the_mean_by_inverse_variances():
    found = combined([mass(1.0, 0.1), mass(2.0, 0.2)], 2.5)["mass_kg"]
    assert found.value == pytest.approx((1.0 / 0.01 + 2.0 / 0.04) / (100.0 + 25.0))
    assert found.high - found.low == pytest.approx(5.0 * 0.1)
    alone = combined([mass(1.0, 0.1)], 2.5)
    assert alone["mass_kg"].value == pytest.approx(1.0)
    assert alone["mass_kg"].low == pytest.approx(0.75)


def test_sizes_that_are_too_far_apart_are_not_of_one_body():
    """At the stated rate of estimates that are."""
    rng = np.random.default_rng(7)
    drawn = [
        [mass(rng.normal(2.0, sd), sd) for sd in (0.1, 0.3, 0.2)] for _ in range(5000)
    ]
    assert sum(disagree(each, 2.5) for each in drawn) <= 15
    assert disagree([mass(1.0, 0.1), mass(2.0, 0.1)], 2.5)
    assert not disagree([mass(1.0, 0.1), mass(1.3, 0.1)], 2.5)
