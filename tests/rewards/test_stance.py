import jax.numpy as jnp
import numpy as np
import pytest

import rewards

LEVEL, UPSIDE_DOWN = jnp.array([0.0, 0.0, -1.0]), jnp.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("tilt_deg", "value"), [(0, 0), (60, 0.5), (90, 1), (120, 1.5), (180, 2)]
)
def test_palm_tilt_grows_to_upside_down(tilt_deg, value):
    angle = np.deg2rad(tilt_deg)
    gravity_v = jnp.array([np.sin(angle), 0.0, -np.cos(angle)])
    assert rewards.palm_tilt(gravity_v) == pytest.approx(value, abs=1e-6)


def test_height_falls_to_its_width():
    at = rewards.stance_height(jnp.array(0.127), jnp.array(0.127))
    below = rewards.stance_height(jnp.array(0.027), jnp.array(0.127))
    above = rewards.stance_height(jnp.array(0.227), jnp.array(0.127))
    assert at == 1.0
    assert below == pytest.approx(np.exp(-1), rel=1e-5) == above


def test_a_hand_that_rises_is_paid_for_height_as_far_as_it_is_level():
    on_its_side = jnp.array([0.0, 1.0, 0.0])
    at, below = jnp.array(0.108), jnp.array(0.028)
    assert rewards.level_height(at, at, LEVEL) == 1.0
    assert rewards.level_height(at, at, on_its_side) == pytest.approx(0.25)
    assert rewards.level_height(at, at, UPSIDE_DOWN) == 0.0
    assert rewards.level_height(below, at, LEVEL) == pytest.approx(np.exp(-1), rel=1e-5)


def test_pose_is_a_mean_over_the_joints_and_needs_an_upright_hand():
    stance = jnp.linspace(-1, 1, 20)
    assert rewards.stance_pose(stance, stance, LEVEL) == pytest.approx(1.0)
    away = rewards.stance_pose(stance + 0.5, stance, LEVEL)
    assert away == pytest.approx(np.exp(-1), rel=1e-5)
    leaning = jnp.array([np.sin(np.pi / 3), 0.0, -0.5])
    assert rewards.stance_pose(stance, stance, leaning) == pytest.approx(
        0.5**8, rel=1e-5
    )
    assert rewards.stance_pose(stance, stance, UPSIDE_DOWN) == 0.0
