import dataclasses

import mujoco
import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from envs.errors import InputError
from envs.hand.hand_file import load_hand_file
from envs.hand.stance import load_stance, settle
from envs.hand.stance_search import (
    StanceProblem,
    StanceWeights,
    palm_quat,
    search_stance,
)
from envs.hand.support import support_margins

SEED = 20260116
HAND = load_hand_file()
STANCE = load_stance()


@pytest.fixture(scope="module")
def problem():
    return StanceProblem(HAND, StanceWeights())


@pytest.fixture(scope="module")
def stored(problem):
    """The stored targets in the pose that puts five tips on the floor."""
    root = Rotation.from_quat(STANCE.root_quat_w, scalar_first=True)
    level = Rotation.from_quat(palm_quat(0.0, 0.0), scalar_first=True)
    _, roll, pitch = (root * level.inv()).as_euler("ZXY")
    pose = least_squares(
        lambda pose: problem.tip_gaps(np.r_[pose, STANCE.target_rad]),
        [pitch, roll, STANCE.root_pos_w[2]],
        xtol=1e-12,
        ftol=1e-12,
    )
    assert np.abs(pose.fun).max() < 1e-5
    return np.r_[pose.x, STANCE.target_rad]


def near(problem, stored):
    """A start 2° and 3 mm away, and 1° in each joint."""
    print(f"seed {SEED}")
    rng = np.random.default_rng(SEED)
    joints = stored[3:] + rng.uniform(-0.02, 0.02, 20)
    joints = np.clip(joints, problem.low + 0.1, problem.high - 0.1)
    return np.r_[stored[:3] + np.array([0.03, 0, 0.003]), joints]


@pytest.fixture(scope="module")
def found(problem, stored):
    return problem.solve(near(problem, stored))


def cost(problem, x):
    return np.sum(problem.residuals(x) ** 2)


def test_the_stored_targets_are_an_optimum_of_the_documented_problem(
    problem, stored, found
):
    """The cost is flat there, so it is compared, and the angles loosely."""
    assert found.success
    assert found.fun == pytest.approx(cost(problem, stored), rel=0.01)
    np.testing.assert_allclose(found.x[3:], STANCE.target_rad, atol=0.1)


def test_the_optimum_is_feasible_and_any_step_from_it_costs(problem, found):
    assert np.abs(problem.tip_gaps(found.x)).max() < 1e-6
    least = cost(problem, found.x)
    free = (found.x[3:] > problem.low + 0.101) & (found.x[3:] < problem.high - 0.101)
    rng = np.random.default_rng(SEED)
    for _ in range(20):
        step = np.r_[rng.normal(0, 0.02, 3), rng.normal(0, 0.02, 20) * free]
        gaps = problem.tip_gaps(found.x + step)
        # Penalized: off the constraint the cost alone may fall.
        merit = cost(problem, found.x + step) + 1e5 * np.abs(gaps).sum()
        assert merit > least


def test_same_seed_same_result(problem, stored, found):
    again = problem.solve(near(problem, stored))
    np.testing.assert_array_equal(again.x, found.x)
    starts = [problem.random_start(np.random.default_rng(s)) for s in (1, 1, 2)]
    np.testing.assert_array_equal(starts[0], starts[1])
    assert not np.array_equal(starts[0], starts[2])


def test_search_without_a_stance_is_an_error(monkeypatch):
    def nothing(self, start):
        return type("Result", (), {"x": start, "fun": 0.0})

    monkeypatch.setattr(StanceProblem, "solve", nothing)
    with pytest.raises(InputError, match="starts: found 2"):
        search_stance(HAND, seed=0, starts=2)


@pytest.mark.slow
def test_search_finds_the_stored_stance():
    """The search that made stance.json, up to what a flat optimum leaves open."""
    print("seed 0")
    qpos, target = search_stance(HAND)
    np.testing.assert_allclose(target, STANCE.target_rad, atol=0.05)
    stance = settle(HAND, qpos, target)
    np.testing.assert_allclose(stance.footprint_v, STANCE.footprint_v, atol=2e-3)


def test_margins_of_a_regular_pentagon():
    """From the centre of a pentagon of radius r, every edge is r cos 36° away."""
    angles = np.deg2rad(72) * np.arange(5)
    tips = 0.05 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    tips = tips[[0, 4, 3, 2, 1]]
    inside = 0.05 * np.cos(np.deg2rad(36))
    np.testing.assert_allclose(support_margins(np.zeros(2), tips), inside, rtol=1e-6)
    mirrored = tips * [1, -1]
    np.testing.assert_allclose(
        support_margins(np.zeros(2), mirrored), inside, rtol=1e-6
    )
    far = support_margins(np.array([1.0, 0.0]), tips)
    assert far.min() == pytest.approx(inside - np.cos(np.deg2rad(36)))


@pytest.mark.parametrize("pitch", [-0.4, 0.0, 0.7])
def test_palm_orientation(pitch):
    """Palm side down and fingers forward, the fingers lowered by the pitch."""
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, palm_quat(pitch, 0.0))
    palm_normal, _, fingers = axes.reshape(3, 3).T
    np.testing.assert_allclose(
        palm_normal, [-np.sin(pitch), 0, -np.cos(pitch)], atol=1e-12
    )
    np.testing.assert_allclose(fingers, [np.cos(pitch), 0, -np.sin(pitch)], atol=1e-12)


def test_a_preference_without_weight_costs_nothing(problem, found):
    """Each weight scales its own part of the cost only."""
    names = [f.name for f in dataclasses.fields(StanceWeights)]
    zero = StanceWeights(**dict.fromkeys(names, 0.0))
    assert np.sum(StanceProblem(HAND, zero).residuals(found.x) ** 2) == 0
    parts = [
        np.sum(
            StanceProblem(
                HAND, dataclasses.replace(zero, **{n: getattr(problem.weights, n)})
            ).residuals(found.x)
            ** 2
        )
        for n in names
    ]
    assert sum(parts) == pytest.approx(np.sum(problem.residuals(found.x) ** 2))
