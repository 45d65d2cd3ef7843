"""Schedules that go on across stages: where the curricula of a new run begin."""

import dataclasses
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from envs.base import State
from envs.errors import InputError
from fingers_mjx.policy.actor import read
from fingers_mjx.policy.place import is_bundle

_COUNTER = "worlds/memory/world/total_steps"


def steps_done(path: Path) -> int:
    """Returns the control steps that each world of a run has done, in all its stages.

    It is what the reward schedules of the run count (`envs.memory.PerWorldState`).

    Args:
        path: run directory (its newest checkpoint is read) or checkpoint.

    Raises:
        InputError: a bundle or another checkpoint without worlds, no checkpoint, or
            worlds that have not done the same number of steps.
    """
    valid = "a run or checkpoint, whose worlds have counted their steps"
    if is_bundle(path):
        raise InputError("--schedules keep", "--warm-start", f"{path}, a bundle", valid)
    saved = read(path)
    if _COUNTER not in saved.arrays:
        raise InputError(saved.path, _COUNTER, "nothing", valid)
    found = np.unique(saved.arrays[_COUNTER])
    if len(found) != 1:
        counts = ", ".join(map(str, found))
        raise InputError(saved.path, _COUNTER, counts, "the same number in all worlds")
    return int(found[0])


def with_steps(worlds: State, steps: int) -> State:
    """Returns worlds whose schedules have come to a number of control steps.

    Args:
        worlds: of a new run.
        steps: control steps of each world, as from `steps_done`.
    """
    world = worlds.memory.world
    counted = jnp.full_like(world.total_steps, steps)
    memory = worlds.memory.replace(world=world.replace(total_steps=counted))
    return dataclasses.replace(worlds, memory=memory)
