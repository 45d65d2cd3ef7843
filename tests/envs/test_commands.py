import dataclasses

import jax
import numpy as np
import pytest

from envs.commands import CommandConfig, sample_command
from envs.errors import InputError

COUNT = 4000


def draw(config):
    print("seed 20260113")
    keys = jax.random.split(jax.random.key(20260113), COUNT)
    return np.asarray(jax.vmap(lambda key: sample_command(key, config))(keys))


def test_commands_fill_the_ranges_of_the_paper():
    commands = draw(CommandConfig(standing_fraction=0.0))
    low, high = np.array([0.0, -0.16, -0.45]), np.array([0.16, 0.16, 0.45])
    width = high - low
    assert (commands >= low).all() and (commands <= high).all()
    assert (commands.min(axis=0) < low + 0.005 * width).all()
    assert (commands.max(axis=0) > high - 0.005 * width).all()


def test_some_commands_are_to_stand_and_the_others_stay_as_they_are():
    moving, mixed = draw(CommandConfig(standing_fraction=0.0)), draw(CommandConfig())
    standing = (mixed == 0).all(axis=1)
    # 5 % of 4,000 with five standard deviations of 14 on each side
    assert 130 < standing.sum() < 270
    np.testing.assert_array_equal(mixed[~standing], moving[~standing])
    assert (draw(CommandConfig(standing_fraction=1.0)) == 0).all()


def test_another_range_moves_no_other_command():
    fast = dataclasses.replace(CommandConfig(), vel_x_mps=(0.0, 0.3))
    before, after = draw(CommandConfig()), draw(fast)
    np.testing.assert_array_equal(before[:, 1:], after[:, 1:])
    assert (before[:, 0] != after[:, 0]).mean() > 0.9


def test_a_range_the_wrong_way_round_is_refused():
    with pytest.raises(InputError, match=r"yaw_rate_rps: found \[1, -1\]"):
        CommandConfig(yaw_rate_rps=(1.0, -1.0))


def test_shares_of_commands_turn_on_the_spot_or_go_straight():
    every = draw(CommandConfig(standing_fraction=0.0))
    shares = CommandConfig(
        standing_fraction=0.0, turning_fraction=0.2, straight_fraction=0.3
    )
    mixed = draw(shares)
    turning, straight = (mixed[:, :2] == 0).all(axis=1), mixed[:, 2] == 0
    # 20 and 30 % of 4,000 with five standard deviations of 25 and 29 on each side
    assert 670 < turning.sum() < 930 and 1050 < straight.sum() < 1350
    assert not (turning & straight).any()
    np.testing.assert_array_equal(mixed[turning, 2], every[turning, 2])
    np.testing.assert_array_equal(mixed[straight, :2], every[straight, :2])
    rest = ~turning & ~straight
    np.testing.assert_array_equal(mixed[rest], every[rest])


def test_a_share_of_commands_is_to_the_side_alone():
    shares = {"standing_fraction": 0.0, "turning_fraction": 0.2}
    before = draw(CommandConfig(**shares))
    mixed = draw(CommandConfig(**shares, sideways_fraction=0.3))
    sideways = (mixed[:, [0, 2]] == 0).all(axis=1)
    # 30 % of 4,000 with five standard deviations of 29 on each side, half to the left
    assert 1050 < sideways.sum() < 1350
    assert 0.4 < (mixed[sideways, 1] > 0).mean() < 0.6
    np.testing.assert_array_equal(mixed[sideways, 1], before[sideways, 1])
    np.testing.assert_array_equal(mixed[~sideways], before[~sideways])


def test_shares_above_one_are_refused():
    with pytest.raises(InputError, match=r"found 1\.1; valid: 1 at most"):
        CommandConfig(turning_fraction=0.6, straight_fraction=0.5)
    with pytest.raises(InputError, match=r"sideways_fraction: found 1\.2; valid"):
        CommandConfig(straight_fraction=0.6, sideways_fraction=0.6)
