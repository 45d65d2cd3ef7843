"""Where the schedules of a new run begin: read from a checkpoint, put into worlds."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import fingers_mjx
from envs.base import State
from envs.errors import InputError
from envs.memory import Memory, PerWorldState
from fingers_mjx.runs import checkpoint
from fingers_mjx.training.schedules import steps_done, with_steps
from fingers_mjx.training.train import Start

BUNDLE = Path(fingers_mjx.__file__).parent / "policies" / "crawl"


def saved(path, counts, iteration=3):
    """A run directory whose checkpoint has nothing but counters."""
    (path / "checkpoints").mkdir(exist_ok=True)
    world = {"total_steps": jnp.array(counts, jnp.int32)}
    worlds = {"worlds": {"memory": {"world": world}}}
    return checkpoint.save(path / "checkpoints", iteration, worlds, {}, keep=2)


def worlds(counts):
    """Worlds of which only the counters are there."""
    world = PerWorldState(None, None, {}, jnp.array(counts), jnp.array(counts))
    memory = Memory(world, *[None] * 6)
    return State(None, {}, jnp.zeros(2), jnp.zeros(2), {}, {}, None, memory)


def test_the_counter_is_that_of_the_newest_checkpoint(tmp_path):
    older = saved(tmp_path, [72, 72], iteration=3)
    saved(tmp_path, [96, 96], iteration=4)
    assert steps_done(tmp_path) == 96
    assert steps_done(older) == 72


def test_all_worlds_begin_with_it_and_nothing_else_changes():
    after = with_steps(worlds([0, 0, 0]), 96).memory.world
    np.testing.assert_array_equal(after.total_steps, [96, 96, 96])
    assert after.total_steps.dtype == jnp.int32
    np.testing.assert_array_equal(after.episodes, [0, 0, 0])


def test_a_bundle_has_no_counter():
    for path in (BUNDLE, BUNDLE / "policy.onnx"):
        with pytest.raises(InputError, match=r"--schedules keep: .*, a bundle; valid"):
            steps_done(path)


def test_what_has_no_common_counter_is_refused(tmp_path):
    saved(tmp_path, [96, 95])
    with pytest.raises(InputError, match="found 95, 96; valid: the same number"):
        steps_done(tmp_path)
    checkpoint.save(tmp_path / "checkpoints", 9, {"key": jnp.zeros(2)}, {}, keep=1)
    with pytest.raises(InputError, match="found nothing; valid: a run"):
        steps_done(tmp_path)


def test_schedules_are_kept_from_somewhere():
    with pytest.raises(InputError, match="--schedules: found keep; valid: with --warm"):
        Start(keep_schedules=True)
    assert not Start(warm_start=BUNDLE).keep_schedules
