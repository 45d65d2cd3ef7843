"""What an evaluation changes of the training, and which episode it shows."""

from pathlib import Path
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from cli_setup import make_setup

from envs.commands import sample_command
from envs.errors import InputError
from fingers_mjx.evaluate_source import (
    check_policy_settings,
    nominal,
    typical_episode,
    with_command,
)
from fingers_mjx.policy_source import PolicySource


def table(duration, speed):
    columns = {"duration_s": duration, "task_speed_mps": speed}
    return SimpleNamespace(columns={k: np.array(v) for k, v in columns.items()})


@pytest.mark.parametrize(
    ("duration", "speed", "shown"),
    [
        ([20, 20, 20], [0.3, 0.1, 0.2], 2),
        ([20, 3, 20, 20], [0.3, 0.2, 0.1, 0.4], 0),  # the short one does not count
        ([20, 20], [np.nan, 0.1], 1),
        ([20, 20], [np.nan, np.nan], 0),
    ],
)
def test_the_episode_shown_is_the_median_of_the_longest(duration, speed, shown):
    assert typical_episode(table(duration, speed)) == shown


def test_one_command_leaves_nothing_to_chance():
    command = with_command(make_setup(), (0.1, -0.05, 0.3)).env.command
    for seed in range(20):
        drawn = sample_command(jax.random.key(seed), command)
        np.testing.assert_allclose(drawn, [0.1, -0.05, 0.3], atol=1e-7)


def test_the_nominal_hand_has_neither_spread_nor_noise():
    env = nominal(make_setup()).env
    ranges = vars(env.randomize)
    assert ranges["tip_friction"] == (0.88, 0.88)
    for name in ("gain_scale", "effort_scale", "palm_mass_scale"):
        assert ranges[name] == (1.0, 1.0)
    rest = set(ranges) - {"tip_friction", "gain_scale", "effort_scale"}
    zero = [ranges[name] for name in sorted(rest - {"palm_mass_scale"})]
    assert all(np.all(np.array(value) == 0.0) for value in zero), ranges
    assert (env.reset_joint_rad, env.reset_speed_mps) == (0.0, 0.0)


def test_settings_of_the_learner_are_refused():
    check_policy_settings(["env.episode_s=3"])
    with pytest.raises(InputError, match=r"seed=1.*env\.FIELD"):
        check_policy_settings(["env.episode_s=3", "seed=1"])


@pytest.mark.parametrize(
    ("path", "name"),
    [("/home/me/run", "run"), ("/home/me/run/policy.onnx", "run/policy.onnx")],
)
def test_a_policy_is_named_without_the_way_to_it(path, name):
    setup = make_setup()
    assert PolicySource(Path(path), setup, None, 0).name == name
