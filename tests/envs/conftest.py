"""A registered task, compiled once and shared by all tests of a process."""

import dataclasses
from dataclasses import dataclass
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.base import State
from envs.batch import BatchEnv
from envs.registry import get_task, make_batch

WORLDS = 8
EPISODE_STEPS = 20
SEED = 20260110


@dataclass(frozen=True)
class Compiled:
    """A batch with short episodes, its compiled functions and a first state."""

    batch: BatchEnv
    reset: Any
    step: Any
    first: State
    seed: int = SEED

    def actions(self, steps: int, scale: float = 0.3) -> np.ndarray:
        """Random policy outputs, (steps, worlds, joints); the seed is printed."""
        print(f"seed {SEED}")
        shape = (steps, self.batch.num_envs, self.batch.action_size)
        return np.random.default_rng(SEED).normal(0, scale, shape).astype(np.float32)

    def roll(self, state: State, actions: np.ndarray) -> list[State]:
        """States after each of the actions."""
        states = []
        for action in actions:
            state = self.step(state, action)
            states.append(state)
        return states


@cache
def compiled(name: str, worlds: int = WORLDS, **changes: Any) -> Compiled:
    config = get_task(name).config()
    short = {"episode_s": EPISODE_STEPS * config.control_dt_s}
    config = dataclasses.replace(config, **(short | changes))
    batch = make_batch(name, worlds, config, backend="cpu")
    reset, step = jax.jit(batch.reset), jax.jit(batch.step)
    return Compiled(batch, reset, step, reset(jax.random.key(SEED)))


@pytest.fixture(scope="session")
def make_compiled():
    return compiled


@pytest.fixture(scope="session")
def crawl():
    return compiled("crawl")


def as_numpy(tree: Any) -> dict[str, np.ndarray]:
    """Leaves by path; random keys as their words."""

    def host(x):
        is_key = jnp.issubdtype(x.dtype, jax.dtypes.prng_key)
        return np.asarray(jax.random.key_data(x) if is_key else x)

    leaves = jax.tree_util.tree_leaves_with_path(tree)
    return {jax.tree_util.keystr(path): host(x) for path, x in leaves}


@pytest.fixture(scope="session")
def differing():
    """Returns a function: paths at which two trees are not the same bit for bit."""

    def paths(a: Any, b: Any, where: Any = slice(None), where_b: Any = None):
        one, two = as_numpy(a), as_numpy(b)
        assert one.keys() == two.keys()
        other = where if where_b is None else where_b
        pairs = ((k, one[k][where], two[k][other]) for k in one)
        return [k for k, x, y in pairs if x.tobytes() != y.tobytes()]

    return paths
