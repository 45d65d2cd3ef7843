"""Keys, their events, and that the physics lets one finger press while four stand."""

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from support.keyboard_rig import Rig

from envs.hand.nominal import vendor_hand
from envs.tasks.keyboard.model import (
    ACTUATION_M,
    ARROWS,
    FORCE_N,
    KEY_CENTRES_M,
    KEY_NAMES,
    PITCH_M,
    RELEASE_M,
    TRAVEL_M,
    key_events,
    key_spring,
)
from envs.tasks.keyboard.stance import PLACEMENT, SUPPORTS, fingertip_v


def events(depths_mm, actuation_m=ACTUATION_M):
    """Key-down events of one key along a sequence of depths."""
    down, seen = jnp.zeros(1, bool), []
    for depth in depths_mm:
        depth_m = jnp.array([depth * 1e-3])
        down, pressed = key_events(down, depth_m, jnp.array([actuation_m]))
        seen.append(bool(pressed[0]))
    return seen


def test_a_key_closes_once_and_opens_higher_than_it_closes():
    assert events([0, 1.9, 2.0, 3.9, 2.0]) == [False, False, True, False, False]
    still = ACTUATION_M * 1e3 - RELEASE_M * 1e3 + 0.05
    assert events([2.1, still, 2.1]) == [True, False, False]  # never released
    assert events([2.1, still - 0.1, 2.1]) == [True, False, True]
    assert events([2.1], actuation_m=0.0026) == [False]


def test_the_spring_has_its_force_at_the_actuation_depth():
    force, depth = jnp.array([0.4, 0.58]), jnp.array([0.002, 0.0014])
    stiffness, free = key_spring(force, depth)
    np.testing.assert_allclose(stiffness * (depth - free), force, rtol=1e-6)
    np.testing.assert_allclose(stiffness * -free, force / 2, rtol=1e-6)


def test_the_layout_is_that_of_a_75_percent_keyboard():
    place = dict(zip(KEY_NAMES, KEY_CENTRES_M, strict=True))
    assert ARROWS == KEY_NAMES[:4] == ("left", "down", "right", "up")
    np.testing.assert_allclose(place["right"] - place["left"], [2 * PITCH_M, 0])
    np.testing.assert_allclose(place["up"] - place["down"], [0, 0.01905])
    # Right Shift ends where Up begins, Right Ctrl where Left begins.
    shift_end = place["right_shift"][0] + 1.75 * PITCH_M / 2
    assert shift_end == pytest.approx(place["up"][0] - PITCH_M / 2)
    assert place["right_ctrl"][0] == pytest.approx(place["left"][0] - PITCH_M)


@pytest.fixture(scope="module")
def rig():
    return Rig()


def test_a_force_on_a_key_moves_it_as_the_data_sheet_says(rig):
    model, data = rig.model, mujoco.MjData(rig.model)
    data.qpos[2] = 1.0  # the hand is away
    body = model.body("key_up").id

    def depth_m(force_n):
        for _ in range(100):
            data.qpos[2], data.qvel[:6] = 1.0, 0.0
            data.xfrc_applied[body, 2] = -force_n
            mujoco.mj_step(model, data)
        return data.qpos[27 + KEY_NAMES.index("up")]

    assert abs(depth_m(0.0)) < 1e-4
    assert depth_m(0.9 * FORCE_N) < ACTUATION_M < depth_m(1.1 * FORCE_N)
    assert depth_m(5.0) == pytest.approx(TRAVEL_M, abs=5e-4)
    others = np.delete(data.qpos[27:], KEY_NAMES.index("up"))
    assert np.abs(others).max() < 1e-4


def test_forward_kinematics_are_those_of_the_model(rig):
    data = mujoco.MjData(rig.model)
    rng = np.random.default_rng(4)
    low, high = vendor_hand().per_joint("range_rad").T
    for _ in range(10):
        joints = rng.uniform(low, high)
        data.qpos[:7], data.qpos[7:27] = rng.normal(size=7), joints
        mujoco.mj_kinematics(rig.model, data)
        frame, tip = data.site("control_frame"), data.site("middle_tip")
        expected = frame.xmat.reshape(3, 3).T @ (tip.xpos - frame.xpos)
        found = fingertip_v(jnp.array(joints), jnp.array(rig.stance.q_off))
        np.testing.assert_allclose(found, expected, atol=1e-6)


def test_every_arrow_key_is_in_reach_of_the_stance(rig):
    for point in rig.press_points().values():
        rig.reach(point)
        assert rig.reach_error_m < 1e-4


def test_supports_stand_before_the_case_and_carry_the_hand(rig):
    front = PLACEMENT.to_world(np.array([[0.0, -PITCH_M / 2 - 0.006]]))[0]
    away = PLACEMENT.to_world(np.array([[0.0, 1.0]]))[0]
    away -= PLACEMENT.to_world(np.zeros((1, 2)))[0]
    feet = np.array(rig.stance.footprint_v)[list(SUPPORTS), :2]
    assert ((feet - front) @ away < -0.0075).all()
    for _ in range(20):
        rig.step(rig.rest)
    assert rig.data.ncon == len(SUPPORTS)
    load = []
    for contact in range(rig.data.ncon):
        force = np.zeros(6)
        mujoco.mj_contactForce(rig.model, rig.data, contact, force)
        load.append(force[0])
    assert min(load) > 1.0  # more than a key press takes away


@pytest.mark.parametrize("friction", [0.3, 0.88])
def test_a_scripted_finger_presses_what_is_asked(friction):
    """No learning: joint targets from inverse kinematics, at the policy's speed."""
    rig = Rig(friction=friction)
    for _ in range(20):
        rig.step(rig.rest)
    feet = rig.feet_w()
    presses = [rig.press(name) for name in ARROWS * 3]
    assert [p.pressed for p in presses] == [(p.asked,) for p in presses]
    assert np.median([p.latency_s for p in presses]) <= 0.24
    assert max(p.tilt_deg for p in presses) < 3.0
    assert np.linalg.norm(rig.feet_w() - feet, axis=1).max() < 0.003


def test_on_a_keyboard_that_lies_elsewhere_it_presses_the_wrong_keys():
    """Negative control: one pitch to the right, every press of a row is its left."""
    rig = Rig(shift_m=(0.01905, 0.0))
    pressed = {name: rig.press(name).pressed for name in ("down", "right")}
    assert pressed["down"] == ("left",) and "right" not in pressed["right"]
