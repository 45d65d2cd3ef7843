"""What an evaluation changes of the settings of the training."""

import dataclasses

import jax
import numpy as np
import pytest
from support.cli_setup import make_setup

from envs.commands import sample_command
from fingers_mjx.evaluation.setups import nominal, with_command, with_fields


@pytest.mark.parametrize("kind", ["standing", "turning", "straight", "sideways"])
def test_one_command_leaves_nothing_to_chance(kind):
    """Whatever commands the policy was trained with."""
    setup = make_setup()
    mixture = dataclasses.replace(setup.env.command, **{f"{kind}_fraction": 0.9})
    mixed = with_fields(setup, command=mixture)
    command = with_command(mixed, (0.1, -0.05, 0.3)).env.command
    for seed in range(20):
        drawn = sample_command(jax.random.key(seed), command)
        np.testing.assert_allclose(drawn, [0.1, -0.05, 0.3], atol=1e-7)


def test_the_nominal_hand_has_neither_spread_nor_noise():
    env = nominal(make_setup()).env
    ranges = vars(env.randomize)
    assert ranges["tip_friction"] == (0.88, 0.88)
    scales = {name for name in ranges if name.endswith("_scale")}
    assert scales > {"gain_scale", "payload_mass_scale"}
    assert {ranges[name] for name in scales} == {(1.0, 1.0)}
    zero = [ranges[name] for name in sorted(set(ranges) - scales - {"tip_friction"})]
    assert all(np.all(np.array(value) == 0.0) for value in zero), ranges
    assert (env.reset_joint_rad, env.reset_speed_mps) == (0.0, 0.0)
