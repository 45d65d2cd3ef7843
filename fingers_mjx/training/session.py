"""A run in memory: environment, learner, the carried state and the compiled call."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from envs.base import State, VectorEnv
from envs.config.typed import to_dict
from fingers_mjx.ppo.config import TrainConfig, bound_fields
from fingers_mjx.ppo.iteration import Iteration, make_iteration, repeat_iterations
from fingers_mjx.ppo.rollout import FAULTS
from fingers_mjx.ppo.state import (
    Carry,
    TrainState,
    init_train_state,
    make_learner,
    strong,
)
from fingers_mjx.ppo.totals import Totals
from fingers_mjx.ppo.update import watched_names
from fingers_mjx.runs.setup import Setup

HEALTH = (
    "worst_streak",
    "skipped",
    "first_term",
    "first_iteration",
    "fault",
    "fault_world",
    "fault_iteration",
)
"""Fields of `Health` that each call reports to the host."""


@dataclass(frozen=True)
class Report:
    """What a call leaves on the device for the host to fetch when it wants to.

    Attributes:
        sums: sum and weight of each metric.
        health: the fields `HEALTH`.
    """

    sums: Array
    health: Array

    def fetch_sums(self) -> Float[np.ndarray, "k 2"]:
        """Waits for the call and returns (Σ w x, Σ w) [its unit, 1] of each metric.

        Source:
            Ours, see `fingers_mjx.ppo.totals.total`.
        """
        return np.asarray(self.sums)

    def fetch_health(self) -> dict[str, int]:
        """Waits for the call and returns its health."""
        return dict(zip(HEALTH, np.asarray(self.health).tolist(), strict=True))


class Session:
    """Compiled training of one environment.

    Args:
        env: batched environment.
        config: of the run.

    Attributes:
        names: of the metrics, in the order of `Report.sums`.
        terms: names that `Health.first_term` points into.
    """

    def __init__(self, env: VectorEnv, config: TrainConfig):
        self.env, self.config = env, config
        self.learner = make_learner(env, config.ppo)
        iteration = repeat_iterations(
            make_iteration(env, self.learner), config.iterations_per_call
        )
        template = self.template()
        shapes = jax.eval_shape(iteration, *_parts(template))
        self.names = sorted(shapes[3])
        self.terms = watched_names(template.train.params)
        self._call = jax.jit(_reporting(iteration), donate_argnums=(0, 1, 2))

    def template(self) -> Carry:
        """Returns shapes and types of the carried state."""
        return jax.eval_shape(self._start, jax.random.key(0))

    def start(self) -> Carry:
        """Returns the carried state of an untrained run."""
        return strong(jax.jit(self._start)(jax.random.key(self.config.seed)))

    def advance(self, carry: Carry) -> tuple[Carry, Report]:
        """Starts the next call and returns without waiting; `carry` is used up."""
        *parts, sums, health = self._call(*_parts(carry))
        return Carry(*parts), Report(sums, health)

    def fault(self, health: Mapping[str, int]) -> str:
        """Returns one sentence on the latest step that was set aside."""
        what = FAULTS[health["fault"]]
        return (
            f"iteration {health['fault_iteration']}: {what} of world "
            f"{health['fault_world']} is not finite; the step was set aside"
        )

    def _start(self, key: PRNGKeyArray) -> Carry:
        """Returns fresh networks, worlds and key, all from one seed."""
        key, key_worlds, key_networks = jax.random.split(key, 3)
        train = init_train_state(self.learner, self.env, key_networks)
        return Carry(train, self.env.reset(key_worlds), key)


def bound(env: VectorEnv, setup: Setup, identity: Mapping[str, Any]) -> dict[str, Any]:
    """Returns what a resumed run must share with the saved one.

    JAX counts up to its minor version: later ones draw other random numbers and
    compile other programs.
    """
    return {
        "train": bound_fields(setup.train),
        "env": to_dict(setup.env),
        "observation_size": dict(env.observation_size),
        "action_size": env.action_size,
        "identity": dict(identity),
        "jax": ".".join(jax.__version__.split(".")[:2]),
        "platform": jax.default_backend(),
    }


def _parts(carry: Carry) -> tuple[TrainState, State, PRNGKeyArray]:
    """Returns the three arguments of an iteration."""
    return carry.train, carry.worlds, carry.key


def _reporting(iteration: Iteration) -> Callable[..., tuple]:
    """Returns `iteration` with its metrics and health packed into two arrays."""

    def call(train: TrainState, worlds: State, key: PRNGKeyArray) -> tuple:
        train, worlds, key, totals = iteration(train, worlds, key)
        health = jnp.stack([getattr(train.health, name) for name in HEALTH])
        return train, worlds, key, _pack(totals), health

    return call


def _pack(totals: Totals) -> Float[Array, "k 2"]:
    """Returns the totals as one array, in the order of their names."""
    return jnp.stack([totals[name] for name in sorted(totals)])
