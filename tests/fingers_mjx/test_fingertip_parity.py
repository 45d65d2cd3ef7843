"""The shim's fingertip is the one of training."""

import jax.numpy as jnp
import numpy as np

from envs.hand.hand_file import load_hand_file
from envs.hand.nominal import vendor_hand
from envs.tasks.keyboard.stance import JOINTS, fingertip_v, keyboard_stance
from fingers_robot.behaviour.keyboard.fingertip import FIRST_JOINT, pressing_fingertip


def test_shim_and_training_agree_over_the_joint_ranges():
    q_off = keyboard_stance(load_hand_file()).q_off
    low, high = vendor_hand().per_joint("range_rad").T
    rng = np.random.default_rng(11)
    for _ in range(20):
        joints = rng.uniform(low, high)
        ours = fingertip_v(jnp.array(joints), jnp.array(q_off))
        np.testing.assert_allclose(pressing_fingertip(joints, q_off), ours, atol=1e-6)
    assert JOINTS.start == FIRST_JOINT
    joints[FIRST_JOINT] += 0.01  # negative control
    assert np.abs(pressing_fingertip(joints, q_off) - ours).max() > 1e-4
