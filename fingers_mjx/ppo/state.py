"""What learning changes, and the parts that change it."""

from collections.abc import Callable
from typing import Any

import flax.struct
import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Int, PRNGKeyArray

from envs.base import State, VectorEnv
from fingers_mjx.ppo.brax import (
    PPONetworkParams,
    PPONetworks,
    RunningStatisticsState,
    brax_loss,
    init_normalizer,
    make_networks,
    make_optimizer,
)
from fingers_mjx.ppo.config import PpoConfig
from fingers_mjx.ppo.health import Health, healthy

Loss = Callable[..., tuple[Array, dict[str, Array]]]


@flax.struct.dataclass
class TrainState:
    """Everything that learning changes, except the worlds and the random key.

    Attributes:
        params: actor and critic.
        optimizer: Adam's moments and the current learning rate.
        normalizer: running statistics of the observations.
        health: skipped updates.
        iteration: iterations done.
    """

    params: PPONetworkParams
    optimizer: optax.OptState
    normalizer: RunningStatisticsState
    health: Health
    iteration: Int[Array, ""]


@flax.struct.dataclass
class Carry:
    """The whole state of a run, which a checkpoint holds.

    Attributes:
        train: what learning changes.
        worlds: state of the batched environment.
        key: random key of the next iteration.
    """

    train: TrainState
    worlds: State
    key: PRNGKeyArray


@flax.struct.dataclass
class Learner:
    """The parts an iteration is made of: networks, optimizer, loss and settings."""

    networks: PPONetworks
    optimizer: optax.GradientTransformation
    loss: Loss
    config: PpoConfig


def make_learner(env: VectorEnv, config: PpoConfig) -> Learner:
    """Returns the parts that fit the observations and actions of `env`."""
    networks = make_networks(env.observation_size, env.action_size, config)
    return Learner(networks, make_optimizer(config), brax_loss(networks), config)


def init_train_state(learner: Learner, env: VectorEnv, key: PRNGKeyArray) -> TrainState:
    """Returns untrained networks, a fresh optimizer and an empty normalizer."""
    key_policy, key_value = jax.random.split(key)
    params = PPONetworkParams(  # pyright: ignore[reportCallIssue]
        policy=learner.networks.policy_network.init(key_policy),  # pyright: ignore
        value=learner.networks.value_network.init(key_value),  # pyright: ignore
    )
    state = TrainState(
        params=params,
        optimizer=learner.optimizer.init(params),  # pyright: ignore
        normalizer=init_normalizer(env.observation_size),
        health=healthy(),
        iteration=jnp.zeros((), jnp.int32),
    )
    return strong(state)


def train_template(env: VectorEnv, config: PpoConfig) -> TrainState:
    """Returns shapes and types of what learning changes."""
    learner = make_learner(env, config)
    return jax.eval_shape(
        lambda key: init_train_state(learner, env, key), jax.random.key(0)
    )


def fixed_types(tree: Any) -> Any:
    """Returns `tree` without weak types, for which the next call would recompile."""

    def fix(leaf: Array) -> Array:
        if jnp.issubdtype(leaf.dtype, jax.dtypes.extended):
            return leaf
        return jax.lax.convert_element_type(leaf, leaf.dtype)

    return jax.tree.map(fix, tree)


def strong(tree: Any) -> Any:
    """Returns `tree` in arrays of their own with fixed types.

    A Python number or a weakly typed array would be compiled for again once the first
    iteration has turned it into an array of fixed type; two leaves that share one
    buffer could not both be given away to an iteration.
    """
    arrays = jax.tree.map(jnp.asarray, tree)
    return jax.tree.map(jnp.copy, fixed_types(arrays))
