"""Practice poses lie on the way down, and only training starts from them."""

import jax
import numpy as np
import pytest

from envs.hand.hand_file import load_hand_file
from envs.hand.model import build_model
from envs.hand.stance import stance_of
from envs.registry import make_env
from envs.tasks.recovery.falls import OTHER_PER_SIDE, SIDES, load_falls
from envs.tasks.recovery.lying import clearance_m, down_b, turned_down
from envs.tasks.recovery.practice import (
    SINKING,
    TIPPING,
    load_practice,
    settle_practice,
)
from envs.tasks.recovery.task import RecoveryConfig

HAND = load_hand_file()
LEVEL = down_b(np.array(stance_of(HAND).qpos))


def tilt_deg(qpos):
    return np.degrees(np.arccos(np.clip(down_b(np.array(qpos)) @ LEVEL, -1.0, 1.0)))


def test_stored_poses_are_spread_from_the_stance_to_the_farthest_fall():
    tilts = np.array([tilt_deg(pose) for pose in load_practice()])
    assert len(tilts) == SINKING + TIPPING
    assert tilts[0] < 5.0
    assert np.max(np.diff(np.sort(tilts))) < 10.0
    falls = load_falls()
    first = [falls.side.index(side) for side in SIDES]
    own = [falls.qpos[k] for one in first for k in range(one, one + OTHER_PER_SIDE)]
    farthest = max(tilt_deg(pose) for pose in own)
    assert abs(tilts.max() - farthest) < 5.0


@pytest.mark.slow
def test_stored_poses_are_those_of_the_default_hand():
    made = settle_practice(HAND, stance_of(HAND))
    np.testing.assert_allclose(made, load_practice(), atol=1e-4)


def test_stored_poses_do_not_reach_into_the_floor():
    model = build_model(HAND)
    assert all(clearance_m(model, np.array(p)) > -1e-3 for p in load_practice())


@pytest.mark.parametrize("axis", [(0.0, 0.0, -1.0), (0.6, 0.0, 0.8), (1.0, 2.0, -2.0)])
def test_a_direction_is_turned_down(axis):
    qpos = np.concatenate([np.zeros(3), turned_down(np.array(axis)), np.zeros(20)])
    np.testing.assert_allclose(down_b(qpos), axis / np.linalg.norm(axis), atol=1e-12)


@pytest.mark.parametrize(
    ("fraction", "settle", "expected"),
    [(0.0, False, 0.0), (0.5, False, 0.5), (1.0, False, 1.0), (1.0, True, 0.0)],
)
def test_training_starts_from_them_as_often_as_configured(fraction, settle, expected):
    env = make_env(
        "recovery", RecoveryConfig(practice_fraction=fraction, settle=settle)
    )
    keys = jax.random.split(jax.random.key(3), 400)
    joints = np.asarray(jax.vmap(env.task._pose)(keys))[:, 7:]
    falls = np.array(load_falls().qpos, np.float32)[:, 7:]
    fell = (np.abs(joints[:, None] - falls[None]).max(-1) < 1e-6).any(-1)
    assert abs(1.0 - fell.mean() - expected) <= (0.1 if 0 < expected < 1 else 0.0)
