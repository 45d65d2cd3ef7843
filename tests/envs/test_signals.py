"""Signals against values that C MuJoCo gives in another way than its sensors."""

from functools import partial

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from envs.hand.hand_file import load_hand_file
from envs.hand.model import FLOOR, PALM, PAYLOAD, V_SITE, build_model
from envs.hand.nominal import FINGERS, vendor_hand
from envs.hand.spec import hand_spec
from envs.hand.stance import load_stance
from envs.physics.base import PhysicsOutput, PhysicsState
from envs.signals import Command, extract_signals, tilt

SEED = 20260112
STANCE = load_stance()
MODEL = build_model(load_hand_file(), np.array(STANCE.q_off))
SPEC = hand_spec(MODEL)
TIPS = [MODEL.site(f"{finger}_tip").id for finger in FINGERS]
ASKED = Command(jnp.array([0.1, 0.0, 0.2]), jnp.full(20, 0.5), jnp.zeros(20))
DT = 0.02


@partial(jax.jit, static_argnums=0)
def _extract(_, before, output):
    return extract_signals(SPEC, jnp.array(STANCE.q_off), before, output, ASKED, DT)


def read(data, before_qvel=None):
    """Signals with sensors and state of one moment."""
    mujoco.mj_forward(MODEL, data)
    vectors = (data.qpos, data.qvel, data.qacc_warmstart)
    state = PhysicsState(*(jnp.asarray(x, jnp.float32) for x in vectors))
    before = state
    if before_qvel is not None:
        before = state.replace(qvel=jnp.asarray(before_qvel, jnp.float32))
    sensors = jnp.asarray(data.sensordata, jnp.float32)
    return _extract(0, before, PhysicsOutput(state, sensors, jnp.int32(0)))


@pytest.fixture(scope="module")
def moving():
    """A hand that stands on two to five tips while it moves."""
    print(f"seed {SEED}")
    rng = np.random.default_rng(SEED)
    data = mujoco.MjData(MODEL)
    data.qpos[:], data.ctrl[:] = STANCE.qpos, STANCE.target_rad
    for _ in range(12):
        data.ctrl[:] = STANCE.target_rad + rng.uniform(-0.05, 0.05, 20)
        mujoco.mj_step(MODEL, data, 5)
    assert np.abs(data.qvel[3:6]).max() > 0.05 and data.ncon > 1
    return data


def moved(data, dt):
    """Positions a moment later (or earlier) at the present velocity."""
    other = mujoco.MjData(MODEL)
    other.qpos[:] = data.qpos
    mujoco.mj_integratePos(MODEL, other.qpos, data.qvel, dt)
    mujoco.mj_kinematics(MODEL, other)
    return other


def tips_w(data):
    return data.site_xpos[TIPS].copy()


def tips_v(data):
    axes = data.site(V_SITE).xmat.reshape(3, 3)
    return (data.site_xpos[TIPS] - data.body(PALM).xpos) @ axes


def rate(function, data, eps=1e-6):
    """Central difference of a function of the pose."""
    return (function(moved(data, eps)) - function(moved(data, -eps))) / (2 * eps)


def test_tips(moving):
    signals = read(moving)
    np.testing.assert_allclose(signals.tip_pos_v, tips_v(moving), atol=1e-6)
    np.testing.assert_allclose(signals.tip_vel_w, rate(tips_w, moving), atol=1e-5)
    np.testing.assert_allclose(signals.tip_vel_v, rate(tips_v, moving), atol=1e-5)
    axes = moving.site_xmat[TIPS].reshape(5, 3, 3)
    np.testing.assert_allclose(
        signals.pad_tilt_rad, np.arcsin(axes[:, 2, 0]), atol=1e-5
    )


def test_tip_velocity_in_a_turning_hand_is_not_that_in_the_world(moving):
    """Negative control: without the base's rotation the values above would not fit."""
    signals = read(moving)
    axes = moving.site(V_SITE).xmat.reshape(3, 3)
    without = (np.asarray(signals.tip_vel_w) - moving.qvel[:3]) @ axes
    assert np.abs(without - signals.tip_vel_v).max() > 1e-3


def test_base(moving):
    signals = read(moving)
    palm = moving.body(PALM).xmat.reshape(3, 3)
    axes = moving.site(V_SITE).xmat.reshape(3, 3)
    np.testing.assert_allclose(signals.gravity_b, palm.T @ [0, 0, -1], atol=1e-6)
    np.testing.assert_allclose(signals.vel_v, axes.T @ moving.qvel[:3], atol=1e-6)
    spin_w = palm @ moving.qvel[3:6]
    np.testing.assert_allclose(signals.angvel_v, axes.T @ spin_w, atol=1e-6)
    np.testing.assert_allclose(signals.angvel_b, moving.qvel[3:6], atol=1e-6)
    np.testing.assert_allclose(signals.palm_pos_w, moving.qpos[:3], atol=1e-6)


def test_joints(moving):
    signals = read(moving, before_qvel=np.zeros(MODEL.nv))
    np.testing.assert_allclose(signals.joint_pos, moving.qpos[7:], atol=1e-6)
    np.testing.assert_allclose(signals.joint_vel, moving.qvel[6:], atol=1e-6)
    np.testing.assert_allclose(signals.joint_acc, moving.qvel[6:] / DT, rtol=1e-5)
    torque = moving.qfrc_actuator[6:]
    np.testing.assert_allclose(signals.torque_nm, torque, atol=1e-6)
    assert np.abs(torque).max() > 0.05


def floor_force(data, geom):
    """Force on a geom from the floor, from the contact list."""
    ids, total = (MODEL.geom(geom).id, MODEL.geom(FLOOR).id), np.zeros(3)
    for index in range(data.ncon):
        contact = data.contact[index]
        if set(contact.geom) == set(ids):
            wrench = np.zeros(6)
            mujoco.mj_contactForce(MODEL, data, index, wrench)
            total += contact.frame.reshape(3, 3).T @ wrench[:3]
    return total


def test_tip_forces_are_those_of_the_contact_list(moving):
    signals = read(moving)
    expected = [np.linalg.norm(floor_force(moving, link)) for link in SPEC.tip_spheres]
    np.testing.assert_allclose(signals.tip_force_n, expected, rtol=1e-5, atol=1e-6)
    assert np.max(expected) > 1.0


def test_shear_is_the_horizontal_part_of_the_tip_forces(moving):
    forces_w = np.array([floor_force(moving, link) for link in SPEC.tip_spheres])
    expected = np.linalg.norm(forces_w[:, :2], axis=1)
    np.testing.assert_allclose(read(moving).tip_shear_n, expected, rtol=1e-5, atol=1e-5)
    assert 0.05 < np.max(expected) < np.max(forces_w[:, 2])


def test_at_rest_the_tips_carry_the_weight():
    data = mujoco.MjData(MODEL)
    data.qpos[:], data.ctrl[:] = STANCE.qpos, STANCE.target_rad
    mujoco.mj_step(MODEL, data, 400)
    read(data)
    lifted = sum(abs(floor_force(data, link)[2]) for link in SPEC.tip_spheres)
    assert lifted == pytest.approx(MODEL.body_subtreemass[1] * 9.81, rel=1e-3)


def touching(data):
    """Names of all geoms that the contact list has on the floor."""
    floor = MODEL.geom(FLOOR).id
    pairs = [set(data.contact[i].geom) for i in range(data.ncon)]
    return {MODEL.geom(g).name for pair in pairs if floor in pair for g in pair}


@pytest.mark.parametrize("turn_deg", [0, 60, 120, 180, 240, 300])
def test_contacts_of_a_hand_lying_on_the_floor(turn_deg):
    """Turned about its length and dropped, it comes to lie on links, palm or back."""
    data = mujoco.MjData(MODEL)
    data.qpos[:], data.ctrl[:] = STANCE.qpos, STANCE.target_rad
    half = np.deg2rad(turn_deg) / 2
    roll = np.array([np.cos(half), np.sin(half), 0.0, 0.0])
    mujoco.mju_mulQuat(data.qpos[3:7], roll, np.array(STANCE.root_quat_w))
    data.qpos[2] = 0.15
    mujoco.mj_step(MODEL, data, 200)
    signals, down = read(data), touching(data)
    expected = [float(link in down) for link in SPEC.other_links]
    np.testing.assert_array_equal(signals.link_contact, expected)
    assert signals.palm_contact == float(bool({PALM, PAYLOAD} & down))
    if turn_deg in (0, 180):
        assert signals.palm_contact == (turn_deg == 180)


@pytest.mark.parametrize(
    ("roll", "pitch"), [(0, 0), (20, 0), (0, 25), (-30, 10), (170, -60), (0, 90)]
)
def test_tilt_is_roll_then_pitch(roll, pitch):
    """V turned by pitch about its y and then by roll about its own x, any heading."""
    for heading in (0.0, 2.2):
        quat = np.array([1.0, 0.0, 0.0, 0.0])
        turns = (([0, 0, 1], heading), ([0, 1, 0], np.deg2rad(pitch)))
        for axis, angle in (*turns, ([1, 0, 0], np.deg2rad(roll))):
            turn, before = np.zeros(4), quat.copy()
            mujoco.mju_axisAngle2Quat(turn, np.array(axis, float), angle)
            mujoco.mju_mulQuat(quat, before, turn)
        found = np.rad2deg(tilt(jnp.asarray(quat, jnp.float32)))
        assert found[1] == pytest.approx(pitch, abs=0.05)
        if pitch != 90:  # at 90° there is no roll
            assert found[0] == pytest.approx(roll, abs=0.01)


HEADING_FREE = (
    *("joint_pos", "joint_vel", "torque_nm", "gravity_b", "angvel_b", "vel_v"),
    *("angvel_v", "tip_pos_v", "tip_vel_v", "tip_force_n", "pad_tilt_rad", "tilt_rad"),
)


def test_heading_and_place_change_nothing_in_v(moving):
    turned = mujoco.MjData(MODEL)
    turned.qpos[:], turned.qvel[:] = moving.qpos, moving.qvel
    turned.ctrl[:] = moving.ctrl
    yaw = np.array([np.cos(0.7), 0.0, 0.0, np.sin(0.7)])
    mujoco.mju_mulQuat(turned.qpos[3:7], yaw, moving.qpos[3:7])
    mujoco.mju_rotVecQuat(turned.qpos[:3], moving.qpos[:3], yaw)
    mujoco.mju_rotVecQuat(turned.qvel[:3], moving.qvel[:3], yaw)
    turned.qpos[:2] += [0.4, -0.3]
    one, other = read(moving), read(turned)
    for name in HEADING_FREE:
        a, b = (np.asarray(getattr(signals, name)) for signals in (one, other))
        # The pyramid of friction has its sides along the world's axes.
        loose = {"tip_force_n": 0.3}.get(name, 2e-5)
        np.testing.assert_allclose(a, b, atol=loose, err_msg=name)
    assert np.abs(one.tip_vel_w - other.tip_vel_w).max() > 1e-3


def test_names_follow_the_order_of_the_description():
    assert len(SPEC.other_links) == 10 and len(SPEC.tip_spheres) == 5
    assert [link.joint for link in vendor_hand().links] == [
        MODEL.actuator(i).name for i in range(20)
    ]
