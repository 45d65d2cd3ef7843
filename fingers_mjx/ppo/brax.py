"""The one module that imports Brax: its PPO networks, loss, rate and normalizer.

Brax's own `ppo.train` is one function that cannot save or restore the whole training
state, so `fingers_mjx.ppo.iteration` is built from Brax's parts instead.
"""

from collections.abc import Mapping
from types import FunctionType
from typing import Any

import jax
import jax.numpy as jnp
import optax
from brax.training.acme import running_statistics
from brax.training.acme.running_statistics import RunningStatisticsState
from brax.training.agents.ppo import losses, networks, optimizer
from brax.training.agents.ppo.losses import PPONetworkParams
from brax.training.agents.ppo.networks import PPONetworks
from brax.training.types import Transition
from flax import linen
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from fingers_mjx.ppo.advantages import generalized_advantages
from fingers_mjx.ppo.config import PpoConfig
from fingers_mjx.ppo.scalars import PpoScalars

__all__ = [
    "PPONetworkParams",
    "PPONetworks",
    "RunningStatisticsState",
    "Transition",
    "adapt_learning_rate",
    "brax_loss",
    "init_normalizer",
    "learning_rate",
    "make_networks",
    "make_optimizer",
    "sample_action",
    "update_normalizer",
]


def _compute_gae(
    *,
    truncation: Float[Array, "t b"],
    termination: Float[Array, "t b"],
    rewards: Float[Array, "t b"],
    values: Float[Array, "t b"],
    bootstrap_value: Float[Array, " b"],
    lambda_: Float[Array, ""] | float,
    discount: Float[Array, ""] | float,
) -> tuple[Float[Array, "t b"], Float[Array, "t b"]]:
    """`generalized_advantages` as Brax's loss calls them."""
    values = jnp.concatenate([values, bootstrap_value[None]])
    return generalized_advantages(
        rewards, values, 1.0 - truncation, 1.0 - termination, discount, lambda_
    )


_compute_ppo_loss: Any = FunctionType(
    losses.compute_ppo_loss.__code__,
    {**vars(losses), "compute_gae": _compute_gae},
    argdefs=losses.compute_ppo_loss.__defaults__,
)
_compute_ppo_loss.__kwdefaults__ = losses.compute_ppo_loss.__kwdefaults__
"""Brax's loss with our advantages; it has no argument for them, and its module stays as
it is for whoever else imports it."""


def make_networks(
    observation_size: Mapping[str, int], action_size: int, config: PpoConfig
) -> PPONetworks:
    """Returns actor (on "state") and critic (on "privileged_state"), ELU, with noise.

    The action distribution is a plain normal whose standard deviation does not depend
    on the observation: the environment clips and squashes.
    """
    return networks.make_ppo_networks(
        dict(observation_size),
        action_size,
        preprocess_observations_fn=running_statistics.normalize,  # pyright: ignore
        policy_hidden_layer_sizes=config.actor_layers,
        value_hidden_layer_sizes=config.critic_layers,
        activation=linen.elu,
        policy_obs_key="state",
        value_obs_key="privileged_state",
        distribution_type="normal",
        noise_std_type=config.noise_std_type,  # pyright: ignore[reportArgumentType]
        init_noise_std=config.init_noise_std,
        mean_kernel_init_fn=jax.nn.initializers.variance_scaling,
        mean_kernel_init_kwargs={
            "scale": config.init_mean_scale**2,
            "mode": "fan_in",
            "distribution": "uniform",
        },
    )


def make_optimizer(config: PpoConfig) -> optax.GradientTransformation:
    """Returns Adam with a rate kept in its state, after clipping the global norm."""
    adam = optax.inject_hyperparams(optax.adam)(learning_rate=config.learning_rate)
    return optax.chain(optax.clip_by_global_norm(config.max_grad_norm), adam)


def adapt_learning_rate(
    state: optax.OptState, kl: Float[Array, ""], scalars: PpoScalars
) -> optax.OptState:
    """Returns `state` with the rate divided or multiplied by 1.5 as the KL asks.

    η ← max(η_min, η/1.5) if D > 2 D*; η ← min(η_max, 1.5 η) if 0 < D < D*/2; else η.
    D is the mean divergence of an update and D* the desired one [nat], η the rate [1].

    Source:
        Brax, `optimizer.adaptive_kl_learning_rate`; as in RSL-RL.
    """
    own = jax.tree.map(lambda x: x, state)  # Brax writes into the dict it is given
    adapted, _ = optimizer.adaptive_kl_learning_rate(
        own,  # pyright: ignore[reportArgumentType]
        kl,
        scalars.desired_kl,  # pyright: ignore[reportArgumentType]
        scalars.learning_rate_min,  # pyright: ignore[reportArgumentType]
        scalars.learning_rate_max,  # pyright: ignore[reportArgumentType]
    )
    return adapted


def learning_rate(state: optax.OptState) -> Float[Array, ""]:
    """η [1], the current rate of an optimizer made by `make_optimizer`: Δθ = -η·Adam.

    Source:
        Kingma and Ba, "Adam: A Method for Stochastic Optimization", 2015.
    """
    return state[-1].hyperparams["learning_rate"]  # pyright: ignore


def with_learning_rate(state: optax.OptState, rate: Float[Array, ""]) -> optax.OptState:
    """Returns `state` of an optimizer made by `make_optimizer` with the rate η [1]."""
    own = jax.tree.map(lambda x: x, state)  # the dict of the given state stays
    own[-1].hyperparams["learning_rate"] = rate  # pyright: ignore
    return own


def brax_loss(ppo_networks: PPONetworks) -> Any:
    """Returns Brax's loss (params, scalars, normalizer, data, key) -> (loss, terms).

    `data` is a Transition of [worlds, time, ...]; of `next_observation` only the last
    time is read, so it may have length one. Truncated steps do not contribute.
    Advantages are those of `fingers_mjx.ppo.advantages`.
    """

    def loss(
        params: PPONetworkParams,
        scalars: PpoScalars,
        normalizer: RunningStatisticsState,
        data: Transition,
        key: PRNGKeyArray,
    ) -> Any:
        numbers: Any = scalars
        return _compute_ppo_loss(
            params,
            normalizer,
            data,
            key,
            ppo_networks,
            entropy_cost=numbers.entropy_cost,
            discounting=numbers.discount,
            reward_scaling=numbers.reward_scale,
            gae_lambda=numbers.gae_lambda,
            clipping_epsilon=numbers.clip,
            normalize_advantage=True,
            vf_coefficient=numbers.value_cost,
        )

    return loss


def init_normalizer(observation_size: Mapping[str, int]) -> RunningStatisticsState:
    """Returns running mean and deviation of each observation, before any data."""
    shapes = {k: jnp.zeros(n) for k, n in observation_size.items()}
    return running_statistics.init_state(shapes)


def update_normalizer(
    state: RunningStatisticsState,
    observation: Mapping[str, Float[Array, "t b _"]],
    valid: Bool[Array, "t b"],
) -> RunningStatisticsState:
    """Returns `state` after the rows of `observation` that are `valid`.

    n' = n + Σ m; μ' = μ + Σ m (o - μ)/n'; S' = S + Σ m (o - μ)(o - μ'), σ² = S/n, with
    m the mask [1] and o, μ, σ in the unit of the entry [unit of o, such as rad]. If
    nothing was valid, or the new statistics would not be finite, the old are kept.

    Source:
        Welford, "Note on a Method for Calculating Corrected Sums of Squares and
        Products", Technometrics, 1962; Brax, `running_statistics.update`.
    """
    weights = valid.astype(jnp.float32)
    new = running_statistics.update(state, dict(observation), weights=weights)
    finite = [jnp.all(jnp.isfinite(x)) for x in jax.tree.leaves(new)]
    ok = jnp.all(jnp.stack(finite)) & jnp.any(valid)
    return jax.tree.map(lambda n, o: jnp.where(ok, n, o), new, state)


def sample_action(
    ppo_networks: PPONetworks, logits: Any, key: PRNGKeyArray
) -> tuple[Float[Array, "b a"], Float[Array, " b"]]:
    """Action a = μ + σ ε, ε ~ N(0, I), and log π(a) = Σ_j log N(a_j; μ_j, σ_j²) [nat].

    The action has no unit [1]: the environment clips and scales it.

    Source:
        Brax, `NormalDistribution`.
    """
    distribution = ppo_networks.parametric_action_distribution
    action = distribution.sample_no_postprocessing(logits, key)
    return action, distribution.log_prob(logits, action)
