"""The pressing fingertip where geometry says it is without a model."""

import numpy as np
import pytest

from fingers_robot.behaviour.keyboard.fingertip import FIRST_JOINT, pressing_fingertip

UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def tip(**angles):
    joints = np.zeros(20)
    for name, angle in angles.items():
        joints[FIRST_JOINT + int(name[1]) - 1] = angle
    return pressing_fingertip(joints, UPRIGHT)


def test_a_straight_finger_points_along_the_palm():
    x, y, z = tip()
    # Knuckle at 0.0895 m, three phalanges of 44, 30 and 22 mm, leaning 5° back.
    assert z == pytest.approx(0.0895 + 0.004 + 0.0436 + 0.0295 + 0.0215, abs=2e-3)
    assert abs(x) < 0.03 and abs(y) < 0.02


def test_bending_keeps_the_length_of_the_phalanx():
    knuckle = np.array([-0.01046, 0.0074615, 0.089544])
    reach = [np.linalg.norm(tip(j1=a) - knuckle) for a in (-0.2, 0.0, 0.7, 1.5)]
    np.testing.assert_allclose(reach, reach[0], atol=1e-4)
    assert np.linalg.norm(tip(j3=1.4) - knuckle) < reach[0] - 0.01


def test_other_joints_do_not_matter():
    joints = np.random.default_rng(0).normal(size=20)
    other = joints + 1.0
    other[FIRST_JOINT : FIRST_JOINT + 4] = joints[FIRST_JOINT : FIRST_JOINT + 4]
    np.testing.assert_array_equal(
        pressing_fingertip(joints, UPRIGHT), pressing_fingertip(other, UPRIGHT)
    )


def test_v_turns_the_answer():
    half_turn_about_z = (0.0, 0.0, 0.0, 1.0)
    joints = np.linspace(-0.3, 0.9, 20)
    x, y, z = pressing_fingertip(joints, UPRIGHT)
    turned = pressing_fingertip(joints, half_turn_about_z)
    np.testing.assert_allclose(turned, [-x, -y, z], atol=1e-12)
