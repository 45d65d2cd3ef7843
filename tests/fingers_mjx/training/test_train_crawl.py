"""The whole of the crawl environment is in the checkpoint: T3, T4 and T12 with a hand.

A tiny learner on a few worlds with short episodes, so that footprints, gait phases,
histories, delays, randomization and curricula are all in the state that is compared.
"""

import dataclasses

import numpy as np
import pytest
from support.train_setup import assert_same_end, leaves

from envs.batch import BatchEnv
from envs.errors import InputError
from envs.physics.backends import default_backend
from fingers_mjx.policy.interface import identity
from fingers_mjx.policy.source import load_source
from fingers_mjx.ppo.config import PpoConfig, TrainConfig
from fingers_mjx.runs.setup import make_env, new_setup
from fingers_mjx.training.population import Member
from fingers_mjx.training.train import Start, train, train_population

ITERATIONS = 4
TRAIN = TrainConfig(
    preset="cpu",
    num_envs=4,
    iterations=ITERATIONS,
    log_every=2,
    checkpoint_every=2,
    ppo=PpoConfig(
        unroll_length=6,
        epochs=2,
        minibatches=2,
        actor_layers=(16,),
        critic_layers=(16,),
    ),
)
CARRIED = (
    "worlds/memory/world/footprint/",
    "worlds/memory/world/variation/",
    "worlds/memory/world/total_steps",
    "worlds/memory/world/key",
    "worlds/memory/lift/",
    "worlds/memory/history/",
    "worlds/memory/drive/",
    "worlds/memory/command",
    "worlds/memory/target",
    "worlds/memory/action",
    "worlds/data/qpos",
    "worlds/data/qacc_warmstart",
    "train/optimizer/1/hyperparams/learning_rate",
    "train/normalizer/count/lo",
    "train/iteration",
    "key",
)
"""What a resumed run needs besides the networks; see the environment's memory."""


def setup(**changes):
    """Settings of a run with episodes of ten control steps."""
    made = new_setup(TRAIN, None)
    env = dataclasses.replace(made.env, episode_s=0.2, **changes)
    return dataclasses.replace(made, env=env)


def run(path, env: BatchEnv, settings, iterations=ITERATIONS, **how):
    config = dataclasses.replace(settings.train, iterations=iterations)
    settings = dataclasses.replace(settings, train=config)
    return train(env, settings, path, start=Start(**how), identity=identity(env))


@pytest.fixture(scope="module")
def env():
    made = setup()
    return make_env(made, TRAIN.num_envs, "cpu")


@pytest.fixture(scope="module")
def straight(env, tmp_path_factory):
    path = tmp_path_factory.mktemp("crawl") / "straight"
    run(path, env, setup())
    return path


def test_resumed_crawl_is_bit_equal_to_a_straight_one(env, straight, tmp_path):
    """It is also T12: both start from the same seed, in compilations of their own."""
    run(tmp_path / "run", env, setup(), iterations=2)
    halfway = leaves(tmp_path / "run")[1]
    run(tmp_path / "run", env, setup(), resume=True)
    assert_same_end(straight, tmp_path / "run")
    iteration, arrays = leaves(tmp_path / "run")
    assert iteration == ITERATIONS
    for part in CARRIED:
        assert any(name.startswith(part) for name in arrays), part
    moved = [k for k in arrays if arrays[k].tobytes() != halfway[k].tobytes()]
    assert "worlds/data/qpos" in moved and "worlds/memory/lift/phase" in moved
    steps = arrays["worlds/memory/world/total_steps"]
    assert (steps == ITERATIONS * TRAIN.ppo.unroll_length).all()
    footprints = [k for k in arrays if k.startswith(CARRIED[0])]
    assert not set(footprints) & set(moved)  # captured once, kept over resets


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"action_scale_rad": 0.05}, "env.action_scale_rad"),
        ({"curriculum_scale": 0.5}, "env.curriculum_scale"),
        ({"max_roll_deg": 20.0}, "env.max_roll_deg"),
    ],
)
def test_resume_with_another_task_is_refused(env, straight, changes, field):
    with pytest.raises(InputError) as error:
        run(straight, env, setup(**changes), resume=True)
    assert error.value.field == field


def test_crawl_in_a_population_is_bit_equal_to_one_alone(straight, tmp_path):
    """Whatever the other member is set to; that one has its own weights and pace."""
    own = setup(
        weights={"lift": 5.0}, curriculum_scale=0.25, schedule_scale={"lift": 0.5}
    )
    ppo = dataclasses.replace(TRAIN.ppo, entropy_cost=0.02)
    other = dataclasses.replace(own, train=dataclasses.replace(TRAIN, seed=7, ppo=ppo))
    members = [Member(other, tmp_path / "other"), Member(setup(), tmp_path / "same")]
    both = make_env(setup(), 2 * TRAIN.num_envs, "cpu")
    train_population(both, members, identity=identity(both))
    assert_same_end(straight, tmp_path / "same")
    arrays, others = (leaves(tmp_path / name)[1] for name in ("same", "other"))
    lift = "worlds/memory/world/weights/lift/start"
    assert (others[lift] == 5.0).all() and (arrays[lift] != 5.0).all()
    assert load_source(tmp_path / "other").setup.env.weights == {"lift": 5.0}


@pytest.mark.slow
@pytest.mark.timeout(3600)  # MJX compiles for minutes
def test_crawl_on_mjx_is_bit_equal_alone_and_in_a_population(tmp_path):
    """Negative control: the other member, of another seed, is not."""
    made = setup()
    made = dataclasses.replace(
        made, train=dataclasses.replace(made.train, backend="jax")
    )
    other = dataclasses.replace(made, train=dataclasses.replace(made.train, seed=7))
    run(tmp_path / "alone", make_env(made, TRAIN.num_envs, "jax"), made)
    members = [Member(other, tmp_path / "other"), Member(made, tmp_path / "same")]
    both = make_env(made, 2 * TRAIN.num_envs, "jax")
    train_population(both, members, identity=identity(both))
    assert_same_end(tmp_path / "alone", tmp_path / "same")
    with pytest.raises(AssertionError):
        assert_same_end(tmp_path / "alone", tmp_path / "other")


@pytest.mark.gpu
def test_resumed_crawl_on_warp_goes_on_where_it_stopped(tmp_path):
    """Warp is not deterministic: counters, curricula and rate are as saved."""
    assert default_backend() == "warp"
    made = setup()
    made = dataclasses.replace(
        made, train=dataclasses.replace(made.train, backend="warp")
    )
    env = make_env(made, TRAIN.num_envs, "warp")
    run(tmp_path / "run", env, made, iterations=2)
    saved = leaves(tmp_path / "run")[1]
    run(tmp_path / "run", env, made, resume=True)
    arrays = leaves(tmp_path / "run")[1]
    step = 2 * TRAIN.ppo.unroll_length
    name = "worlds/memory/world/total_steps"
    np.testing.assert_array_equal(arrays[name], saved[name] + step)
    count = "train/normalizer/count/lo"
    assert arrays[count] == saved[count] + step * TRAIN.num_envs
    kept = [k for k in arrays if k.startswith("worlds/memory/world/variation/")]
    for k in kept:
        np.testing.assert_array_equal(arrays[k], saved[k])
