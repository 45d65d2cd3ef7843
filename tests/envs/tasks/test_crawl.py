import dataclasses
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.config.typed import from_dict, override, to_dict
from envs.errors import InputError
from envs.registry import make_env
from envs.scoring import scheduled_weights
from envs.tasks.crawl import Crawl, CrawlConfig
from rewards import CRAWL

TERMS = {row.name for row in CRAWL}


def with_lasting(state, **changes):
    world = state.memory.world.replace(**changes)
    return state.replace(memory=state.memory.replace(world=world))


def test_sizes(crawl):
    assert crawl.batch.observation_size == {"state": 392, "privileged_state": 427}
    assert crawl.batch.action_size == 20
    logged = {k.removeprefix("reward/") for k in crawl.first.metrics if "/" in k}
    assert logged == TERMS
    env = make_env("crawl")
    assert (env.dt, env.episode_length) == (0.02, 1000)


def test_the_nominal_hand_stands_through_an_episode(crawl):
    still = np.zeros((crawl.batch.episode_length, crawl.batch.num_envs, 20), np.float32)
    states = crawl.roll(crawl.first, still)
    np.testing.assert_array_equal(sum(state.done for state in states[:-1]), 0)
    np.testing.assert_array_equal(states[-1].info["truncation"], 1)
    down = np.asarray(states[-2].signals.tip_force_n > 0.15)
    assert (down.sum(axis=1) >= 4).all() and down.mean() > 0.9


def test_an_action_acts_one_control_step_later(crawl, differing):
    """The transport delay of the hand is one control step of 20 ms."""
    one, other = crawl.actions(2, scale=1.0)
    now = [crawl.step(crawl.first, action) for action in (one, other)]
    assert differing(now[0].data, now[1].data) == []
    assert differing(now[0].signals.torque_nm, now[1].signals.torque_nm) == []
    next_ = [crawl.step(state, one) for state in now]
    assert ".qpos" in differing(next_[0].data, next_[1].data)


def test_the_target_moves_by_the_scaled_tanh_of_the_clipped_action(crawl):
    config = crawl.batch.config
    limits = crawl.batch.plant.joint_range
    action = jnp.asarray(crawl.actions(1, scale=3.0)[0])
    state = crawl.step(crawl.first, action)
    clipped = jnp.clip(action, -config.action_clip, config.action_clip)
    assert (clipped != action).any()
    np.testing.assert_array_equal(state.memory.action, clipped)
    moved = crawl.first.memory.target + 0.060 * jnp.tanh(clipped)
    expected = jnp.clip(moved, limits[:, 0], limits[:, 1])
    np.testing.assert_allclose(state.memory.target, expected, atol=1e-6)
    assert np.asarray(expected != moved).sum() < 3
    high = crawl.first.memory.replace(target=jnp.tile(limits[:, 1] - 0.01, (8, 1)))
    stopped = crawl.step(crawl.first.replace(memory=high), jnp.ones_like(action))
    np.testing.assert_array_equal(stopped.memory.target, jnp.tile(limits[:, 1], (8, 1)))


def test_curricula_follow_the_steps_of_each_world(crawl):
    steps = jnp.array([0, 17_999, 18_000, 36_000, 54_000, 90_000, 18_000, 0])
    command = jnp.tile(jnp.array([0.1, 0.0, 0.2]), (8, 1))
    memory = crawl.first.memory.replace(command=command)
    state = with_lasting(crawl.first.replace(memory=memory), total_steps=steps)
    metrics = crawl.step(state, crawl.actions(1)[0]).metrics

    tracked = np.asarray(metrics["reward/track_yaw_rate"])
    np.testing.assert_array_equal(tracked > 0, np.asarray(steps) >= 18_000)
    assert (tracked <= 0.5 * 0.02).all()


def test_lift_weight_decays_to_a_tenth(crawl):
    """Paper: 6.25 for 18,000 steps, then geometric to 0.625 over 36,000."""
    lift = crawl.first.memory.world.weights["lift"]
    one = jax.tree.map(lambda x: x[0], lift)
    for steps, weight in (
        (0, 6.25),
        (18_000, 6.25),
        (36_000, 1.976424),
        (99_000, 0.625),
    ):
        assert one(steps) == pytest.approx(weight, rel=1e-5)


def test_changed_weights_and_pace():
    weights = scheduled_weights(CRAWL, {"lift": 2.0, "torque": 0.0}, 0.5, {})
    assert weights["lift"](0) == 2.0 and weights["torque"](0) == 0.0
    assert weights["lift"](27_000) == pytest.approx(0.2)
    assert weights["track_yaw_rate"](8_999) == 0.0
    assert weights["track_yaw_rate"](9_000) == 0.5


@pytest.mark.parametrize(("steps", "due"), [(249, False), (250, True), (251, False)])
def test_a_new_command_resets_the_lift_memory(crawl, steps, due):
    """Commands last 5 s, 250 control steps."""
    memory = crawl.roll(crawl.first, crawl.actions(5))[-1].memory
    one = jax.tree.map(lambda x: x[0], memory).replace(steps=jnp.int32(steps))
    assert any(np.asarray(x).any() for x in jax.tree.leaves(one.lift))
    after = Crawl(CrawlConfig()).advance(one, None)
    assert (after.command != one.command).any() == due
    kept = any(np.asarray(x).any() for x in jax.tree.leaves(after.lift))
    assert kept != due


def test_a_step_is_rewarded_for_the_command_that_the_policy_saw(crawl):
    states = crawl.roll(crawl.first, crawl.actions(3))
    for before, after in pairwise([crawl.first, *states]):
        seen = before.obs["state"][:, -3:]
        np.testing.assert_array_equal(seen, before.memory.command)
        np.testing.assert_array_equal(after.signals.command, seen)


def test_footprint_is_captured_in_the_first_step_and_kept_over_resets(crawl):
    assert not np.asarray(crawl.first.memory.world.footprint.captured).any()
    states = crawl.roll(crawl.first, crawl.actions(crawl.batch.episode_length + 3))
    first = states[0].memory.world.footprint
    assert np.asarray(first.captured).all()
    np.testing.assert_array_equal(first.target_v, states[0].signals.tip_pos_v)
    assert np.asarray(states[-1].memory.world.episodes == 1).all()
    last = states[-1].memory.world.footprint
    np.testing.assert_array_equal(last.target_v, first.target_v)


def test_an_invalid_first_step_captures_no_footprint(crawl):
    qvel = crawl.first.data.qvel.at[1, 0].set(jnp.nan)
    bad = crawl.first.replace(data=crawl.first.data.replace(qvel=qvel))
    state = crawl.step(bad, crawl.actions(1)[0])
    captured = np.asarray(state.memory.world.footprint.captured)
    np.testing.assert_array_equal(captured, np.arange(8) != 1)


@pytest.mark.parametrize(
    ("changes", "ends"),
    [
        ({}, False),
        ({"tilt_rad": (0.610, 0.0)}, False),  # 35° are 0.6109 rad
        ({"tilt_rad": (0.612, 0.0)}, True),
        ({"tilt_rad": (-0.612, 0.0)}, True),
        ({"tilt_rad": (0.0, 0.523)}, False),  # 30° are 0.5236 rad
        ({"tilt_rad": (0.0, 0.524)}, True),
        ({"tilt_rad": (0.0, -0.524)}, True),
        ({"palm_contact": 1.0}, True),
        ({"link_contact": np.ones(10)}, False),
        ({"tip_force_n": np.zeros(5)}, False),
    ],
)
def test_terminations(crawl, changes, ends):
    signals = jax.tree.map(lambda x: x[0], crawl.first.signals)
    changes = {name: jnp.asarray(value) for name, value in changes.items()}
    assert bool(Crawl(CrawlConfig()).terminated(signals.replace(**changes))) == ends


def test_a_fall_terminates_and_does_not_truncate(crawl):
    """World 1 is rolled by 50°, world 2 pitched by 40°, 30 cm above the floor."""
    turns = np.tile([1.0, 0.0, 0.0, 0.0], (8, 1))
    half = np.deg2rad([25.0, 20.0])
    turns[1, [0, 1]] = np.cos(half[0]), np.sin(half[0])
    turns[2, [0, 2]] = np.cos(half[1]), np.sin(half[1])
    root = jnp.array(crawl.batch.stance.root_quat_w)
    quat = jax.vmap(lambda turn: _product(turn, root))(jnp.asarray(turns))
    qpos = crawl.first.data.qpos.at[:, 3:7].set(quat).at[:, 2].add(0.3)
    state = crawl.first.replace(data=crawl.first.data.replace(qpos=qpos))
    after = crawl.step(state, crawl.actions(1)[0])
    fallen = np.isin(np.arange(8), [1, 2])
    np.testing.assert_array_equal(after.done, fallen)
    np.testing.assert_array_equal(after.info["truncation"], 0)
    # In the last step a fall is still a fall.
    steps = jnp.full(8, crawl.batch.episode_length - 1)
    last = state.replace(memory=state.memory.replace(steps=steps))
    ended = crawl.step(last, crawl.actions(1)[0])
    np.testing.assert_array_equal(ended.info["truncation"], ~fallen)
    np.testing.assert_array_equal(after.info["invalid"], 0)
    tilt = np.rad2deg(after.signals.tilt_rad)
    np.testing.assert_allclose(tilt[1], [50, 0], atol=3)
    np.testing.assert_allclose(tilt[2], [0, 40], atol=3)


def _product(a, b):
    w = a[0] * b[0] - a[1:] @ b[1:]
    return jnp.append(w, a[0] * b[1:] + b[0] * a[1:] + jnp.cross(a[1:], b[1:]))


@pytest.mark.parametrize(
    ("assignment", "field"),
    [
        ("control_dt_s=0.013", "control_dt_s"),
        ("weights.lfit=3", "weights.lfit"),
        ("command.vel_x_mps=[0.1, 0]", "command.vel_x_mps"),
        ("randomize.tip_friction=[1, 0.5]", "randomize.tip_friction"),
        ("randomize.gain_scale.0=0", "randomize.gain_scale.0"),
        ("randomize.imu_tilt_rad=.nan", "randomize.imu_tilt_rad"),
        ("episode_s=0", "episode_s"),
        ("acton_clip=1", "acton_clip"),
        ("rewards=stok", "rewards"),
        ("weights.feet_air_time=2", "weights.feet_air_time"),
    ],
)
def test_bad_settings_are_named(assignment, field):
    with pytest.raises(InputError) as caught:
        override(CrawlConfig(), [assignment])
    assert caught.value.field == field


def test_settings_survive_as_plain_data():
    config = CrawlConfig(weights={"lift": 1.0}, episode_s=3.0)
    assert from_dict(CrawlConfig, to_dict(config), "memory") == config


def test_commands_cannot_outrun_the_control_interval():
    command = dataclasses.replace(CrawlConfig().command, resample_s=0.02)
    with pytest.raises(InputError, match="resample_s"):
        CrawlConfig(control_dt_s=0.04, command=command)
