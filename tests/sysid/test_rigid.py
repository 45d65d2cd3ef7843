"""Rigid bodies along a motion, against closed forms of a pendulum."""

import numpy as np
import pytest

from envs.physics.quiet_mujoco import mujoco
from sysid.drive import JointDrive, Nominal
from sysid.mechanism import model_mechanism
from sysid.rigid import JointMotion, at_rest, bodies_along, interpolated, mount_gravity

MASS, LENGTH, ARMATURE, G = 0.3, 0.1, 1e-3, 9.81
PENDULUM = f"""
<mujoco><compiler angle="radian"/><worldbody><body>
  <joint name="a" axis="0 1 0" armature="{ARMATURE}"/>
  <inertial pos="0 0 {-LENGTH}" mass="{MASS}" diaginertia="1e-9 1e-9 1e-9"/>
</body></worldbody></mujoco>
"""
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def pendulum():
    model = mujoco.MjModel.from_xml_string(PENDULUM)
    return model_mechanism(model, {"a": JointDrive(Nominal(1.0), Nominal(0.1))})


def test_a_pendulum_weighs_as_its_sine():
    """τ = −m g l sin q, and its slope −m g l cos q."""
    q = np.linspace(-1.0, 1.0, 4001)[:, None]
    gravity = mount_gravity(pendulum(), UPRIGHT)
    bodies = bodies_along(pendulum(), ("a",), at_rest(q), gravity)
    assert bodies.weight == pytest.approx(-MASS * G * LENGTH * np.sin(q), abs=1e-6)
    slope = -MASS * G * LENGTH * np.cos(q)
    assert bodies.weight_slope == pytest.approx(slope, abs=1e-6)
    inertia = MASS * LENGTH**2 + ARMATURE
    assert bodies.inertia == pytest.approx(inertia, rel=1e-5)


def test_slow_rows_do_not_cut_corners():
    """At 50 Hz four rows of a quick swing are a wide chord."""
    q = np.sin(12.0 * np.arange(0.0, 2.0, 0.02))[:, None]
    gravity = mount_gravity(pendulum(), UPRIGHT)
    bodies = bodies_along(pendulum(), ("a",), at_rest(q), gravity)
    assert bodies.weight == pytest.approx(-MASS * G * LENGTH * np.sin(q), abs=1e-6)


def test_nothing_pushes_a_joint_that_is_alone():
    rng = np.random.default_rng(0)
    motion = JointMotion(*rng.normal(size=(3, 50, 1)))
    gravity = mount_gravity(pendulum(), UPRIGHT)
    bodies = bodies_along(pendulum(), ("a",), motion, gravity)
    assert np.all(bodies.push == 0.0)


def test_a_mount_that_lies_on_its_side_turns_gravity():
    half = np.sqrt(0.5)
    assert mount_gravity(pendulum(), (half, 0.0, half, 0.0)) == pytest.approx(
        [G, 0.0, 0.0]
    )


def test_values_between_rows_lie_on_lines_and_stay_after_the_last():
    found = interpolated(np.array([0, 2]), np.array([[0.0], [4.0]]), 5)
    assert found[:, 0].tolist() == [0.0, 2.0, 4.0, 4.0, 4.0]


ARM = """
<mujoco><worldbody><body>
<joint name="a" axis="0 1 0"/>
<inertial pos="0 0 -0.1" mass="0.4" diaginertia="1e-3 1e-3 1e-3"/>
<body pos="0 0 -0.25"><joint name="b" axis="0.6 0.8 0"/>
<inertial pos="0 0.02 -0.12" mass="{mass}" quat="0.9 0.1 0.4 0.2"
 diaginertia="{x} {y} {z}"/>
</body></body></worldbody></mujoco>"""


def arm(mass):
    """Two links, the second of which is heavier but has the same shape."""
    x, y, z = mass / 0.3 * np.array([4e-3, 3e-3, 2e-3])
    return mujoco.MjModel.from_xml_string(ARM.format(mass=mass, x=x, y=y, z=z))


def test_a_payload_weighs_turns_and_is_pushed_as_inverse_dynamics_says():
    """Torques of the same motion with 0.3 kg more, by MuJoCo's inverse dynamics."""
    t = np.arange(0.0, 2.0, 0.002)
    angles = np.stack([0.7 * np.sin(5.0 * t), 0.5 * np.cos(8.0 * t)], 1)
    speeds = np.stack([3.5 * np.cos(5.0 * t), -4.0 * np.sin(8.0 * t)], 1)
    turns = np.stack([-17.5 * np.sin(5.0 * t), -32.0 * np.cos(8.0 * t)], 1)
    motion = JointMotion(angles, speeds, turns)
    drive = JointDrive(Nominal(1.0), Nominal(1.0))
    mechanism = model_mechanism(arm(0.3), {"*": drive})
    gravity = mount_gravity(mechanism, UPRIGHT)
    bodies = bodies_along(mechanism, ("a", "b"), motion, gravity)

    def torques(model):
        data, found = mujoco.MjData(model), []
        for q, v, a in zip(angles, speeds, turns, strict=True):
            data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
            mujoco.mj_inverse(model, data)
            found.append(data.qfrc_inverse.copy())
        return np.array(found)

    more = torques(arm(0.6)) - torques(arm(0.3))
    weighs = bodies.payload_moment @ gravity
    needed = bodies.payload_inertia * turns - weighs - bodies.payload_push
    size = np.abs(more).max()
    assert 0.3 * needed == pytest.approx(more, abs=2e-3 * size)
    assert np.abs(bodies.payload_push).max() > 0.1 * size
