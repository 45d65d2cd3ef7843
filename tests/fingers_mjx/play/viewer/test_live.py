"""The closed loop under the knobs, and what is seen of it."""

import dataclasses

import numpy as np
import pytest

from fingers_mjx.play.viewer.view import body_poses, contact_forces
from fingers_mjx.play.viewer.wishes import Wishes
from rewards.lift import LiftParams, lift_frequency_hz

STILL = Wishes(command=(0.0, 0.0, 0.0))
FORWARD = Wishes(command=(0.1, 0.0, 0.0))


@pytest.fixture
def fresh(live):
    """A new episode, the knobs as they are at the start."""
    live.step(dataclasses.replace(STILL, paused=True, resets=live._resets + 1))
    return live


def wish(live, **given):
    return dataclasses.replace(FORWARD, resets=live._resets, **given)


def test_forces_of_a_hand_that_stands_carry_its_weight(live):
    """At rest in its stance, without a policy: Σ f = m g upward."""
    import mujoco

    model = live.model
    data = mujoco.MjData(model)
    stance = live._plain.env.stance
    data.qpos[: len(stance.qpos)], data.ctrl[:] = stance.qpos, stance.target_rad
    for _ in range(200):
        mujoco.mj_step(model, data)
    total = contact_forces(model, data).force_w.sum(axis=0)
    weight = model.body_subtreemass[1] * 9.81
    np.testing.assert_allclose(total, [0.0, 0.0, weight], atol=0.02 * weight)
    assert len(body_poses(data).pos_w) == model.nbody - 1


def test_springs_are_slack_at_first_and_then_not(fresh):
    view = fresh.step(wish(fresh))
    np.testing.assert_allclose(view.springs.tip_w, view.springs.target_w, atol=5e-3)
    views = [fresh.step(wish(fresh)) for _ in range(15)]
    stretched = views[-1].springs.tip_w - views[-1].springs.target_w
    assert np.abs(stretched).max() > 5e-3
    sites = [fresh._episode.data.site(f"{n}_tip").xpos for n in ("thumb", "little")]
    np.testing.assert_allclose(views[-1].springs.tip_w[[0, 4]], sites, atol=2e-3)


def test_the_phase_turns_as_the_command_says(fresh):
    first, second = (fresh.step(wish(fresh)).lifts for _ in range(2))
    expected = 2 * np.pi * lift_frequency_hz(0.1, LiftParams()) * fresh.dt_s
    assert second.phase_rad - first.phase_rad == pytest.approx(
        float(expected), rel=1e-4
    )
    changed = dataclasses.replace(wish(fresh), command=(0.05, 0.0, 0.0))
    anew = fresh.step(changed).lifts
    assert anew.phase_rad < first.phase_rad


def test_the_command_reaches_policy_and_plots(fresh):
    view = fresh.step(wish(fresh))
    np.testing.assert_allclose(view.command, [0.1, 0.0, 0.0], atol=1e-7)


def test_time_stands_still_while_paused(fresh):
    fresh.step(wish(fresh))
    time_s, pose = fresh.time_s, fresh.pose
    assert fresh.step(wish(fresh, paused=True)) is None
    assert fresh.time_s == time_s
    np.testing.assert_array_equal(fresh.pose, pose)


@pytest.mark.parametrize(("towards", "axis", "sign"), [("left", 1, 1), ("back", 0, -1)])
def test_a_push_moves_the_palm_where_it_says(fresh, towards, axis, sign):
    pushed = fresh.step(wish(fresh, push=towards, push_n=4.0))
    assert np.linalg.norm(pushed.push.force_w) == pytest.approx(4.0)
    for _ in range(4):
        pushed = fresh.step(wish(fresh))
    assert pushed.push is not None
    fresh.step(wish(fresh))
    after = fresh.step(wish(fresh))
    assert after.push is None
    assert sign * pushed.velocity[axis] > 0.05


def test_a_fall_ends_the_episode_after_a_while(fresh):
    fresh.step(wish(fresh))
    fresh._episode.data.qpos[3:7] = [0.0, 1.0, 0.0, 0.0]
    fresh.step(wish(fresh))
    assert fresh.fell
    assert fresh.step(wish(fresh)) is None
    for _ in range(120):
        if not fresh.fell:
            break
        fresh.step(wish(fresh))
    assert fresh.time_s < 1.0


def test_effects_go_on_from_the_same_pose(fresh):
    """Another program goes on where the first one was, history and all."""
    for _ in range(5):
        fresh.step(wish(fresh))
    pose, joints = fresh.pose, fresh._episode.data.qpos[7:27].copy()
    on = wish(fresh, effects={"deadband": 0.03})
    assert fresh.compiles_for(on)
    fresh.step(dataclasses.replace(on, paused=True))
    np.testing.assert_array_equal(fresh.pose, pose)
    np.testing.assert_array_equal(fresh._episode.data.qpos[7:27], joints)
    assert fresh._player.controller.observation is not None
    assert fresh.step(on) is not None
    assert not fresh.compiles_for(wish(fresh, effects={"backlash": 0.02}))


def paths(live, effects):
    live.step(wish(live, paused=True, effects=effects))
    key_of = live._episodes
    live._episodes = 0  # the same world each time
    live.step(
        dataclasses.replace(
            STILL, paused=True, resets=live._resets + 1, effects=effects
        )
    )
    assert key_of
    for _ in range(12):
        live.step(wish(live, effects=effects))
    return live._episode.data.qpos[7:27].copy()


def test_effects_of_no_size_change_nothing_and_others_do(fresh):
    """The whole chain at its identity moves as the hand's own servos."""
    plain = paths(fresh, {})
    nothing = paths(fresh, {"deadband": 0.0})
    felt = paths(fresh, {"deadband": 0.05})
    np.testing.assert_allclose(nothing, plain, atol=2e-3)
    assert np.abs(felt - plain).max() > 1e-2
