"""Presets are fresh and valid; settings that cannot work are refused by name."""

import dataclasses

import pytest

from envs.config.typed import from_dict, to_dict
from envs.errors import InputError
from fingers_mjx.ppo.config import (
    PRESETS,
    STAGES,
    TrainConfig,
    bound_fields,
    check_config,
    paper,
    preset,
)


@pytest.mark.parametrize("name", PRESETS)
def test_presets_are_valid_and_survive_plain_data(name):
    config = preset(name)
    check_config(config)
    assert config.preset == name
    assert from_dict(TrainConfig, to_dict(config), "test") == config


def test_paper_preset_is_the_paper():
    config = paper()
    ppo = config.ppo
    assert (config.num_envs, config.iterations, ppo.unroll_length) == (4096, 8000, 24)
    assert (ppo.epochs, ppo.minibatches, ppo.clip, ppo.learning_rate) == (
        5,
        4,
        0.2,
        1e-3,
    )
    assert (ppo.discount, ppo.gae_lambda, ppo.entropy_cost) == (0.99, 0.95, 0.005)
    assert ppo.actor_layers == (512, 256, 128)
    assert config.steps_per_iteration * config.iterations == 786_432_000


def test_the_second_stage_is_the_first_but_for_length_and_noise():
    first, second = paper(), preset("adapt")
    assert second.iterations == 5000
    assert second.ppo.init_noise_std < first.ppo.init_noise_std
    same = {"preset": "paper", "iterations": 8000, "ppo": first.ppo}
    noise = dataclasses.replace(first.ppo, init_noise_std=second.ppo.init_noise_std)
    assert second.ppo == noise
    assert dataclasses.replace(second, **same) == first


@pytest.mark.parametrize("task", ["crawl", "recovery", "keyboard", "push"])
@pytest.mark.parametrize("name", PRESETS)
def test_manipulation_has_the_papers_critic_in_its_presets_only(name, task):
    layers, crawl = (preset(name, t).ppo.critic_layers for t in (task, "crawl"))
    papers = name in STAGES and task in ("keyboard", "push")
    assert layers == ((256, 128, 64) if papers else crawl)


@pytest.mark.parametrize("name", PRESETS)
def test_tasks_that_start_far_from_the_stance_start_with_small_outputs(name):
    crawl, recovery = preset(name, "crawl"), preset(name, "recovery")
    assert crawl == preset(name) == PRESETS[name]()
    assert (recovery.task, recovery.ppo.init_mean_scale) == ("recovery", 0.01)
    same = dataclasses.replace(recovery.ppo, init_mean_scale=crawl.ppo.init_mean_scale)
    assert dataclasses.replace(recovery, task="crawl", ppo=same) == crawl


def test_unknown_preset_lists_the_valid_ones():
    with pytest.raises(InputError, match="did you mean paper"):
        preset("papr")


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("num_envs", 0),
        ("num_envs", 4097),
        ("seed", -1),
        ("iterations", 0),
        ("hang_limit_s", 0.0),
        ("ppo.discount", 1.5),
        ("ppo.learning_rate", 0.5),
        ("ppo.learning_rate", float("nan")),
        ("ppo.actor_layers", ()),
        ("ppo.critic_layers", (8, 0)),
        ("ppo.noise_std_type", "exp"),
    ],
)
def test_setting_that_cannot_work_is_named(field, value):
    config, name = paper(), field.removeprefix("ppo.")
    if name != field:
        ppo = dataclasses.replace(config.ppo, **{name: value})
        config = dataclasses.replace(config, ppo=ppo)
    else:
        config = dataclasses.replace(config, **{name: value})
    with pytest.raises(InputError) as error:
        check_config(config)
    assert error.value.field.startswith(field)


@pytest.mark.parametrize("name", ["iterations", "log_every", "checkpoint_every"])
def test_counts_fit_the_iterations_of_a_call(name):
    even = {"iterations": 12, "log_every": 6, "checkpoint_every": 6}
    config = dataclasses.replace(paper(), iterations_per_call=3, **even)
    check_config(config)
    with pytest.raises(InputError) as error:
        check_config(dataclasses.replace(config, **{name: 4}))
    assert error.value.field == name


def test_only_what_does_not_touch_learning_is_free():
    free = to_dict(paper()).keys() - bound_fields(paper()).keys()
    assert free == {
        "iterations",
        "log_every",
        "checkpoint_every",
        "keep_checkpoints",
        "on_overflow",
        "hang_limit_s",
        "video_every",
        "loggers",
    }
