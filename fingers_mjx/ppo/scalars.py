"""Numbers of the learner that members of one compiled program may differ in."""

import dataclasses

import flax.struct
import jax.numpy as jnp
from jaxtyping import Array, Float

from fingers_mjx.ppo.config import PpoConfig


@flax.struct.dataclass
class PpoScalars:
    """Settings of PPO that enter the compiled program as arguments.

    Attributes: as those of `PpoConfig`, whose other settings give shapes, lengths of
    loops or the state at the start.
    """

    clip: Float[Array, ""]
    discount: Float[Array, ""]
    gae_lambda: Float[Array, ""]
    entropy_cost: Float[Array, ""]
    value_cost: Float[Array, ""]
    reward_scale: Float[Array, ""]
    learning_rate_min: Float[Array, ""]
    learning_rate_max: Float[Array, ""]
    desired_kl: Float[Array, ""]
    critic_iterations: Float[Array, ""]


@flax.struct.dataclass
class StartScalars:
    """Settings of PPO that only the state at the start depends on.

    Attributes: as those of `PpoConfig`.
    """

    learning_rate: Float[Array, ""]
    init_noise_std: Float[Array, ""]
    init_mean_scale: Float[Array, ""]


OWN_SCALARS = tuple(
    field.name
    for kind in (PpoScalars, StartScalars)
    for field in dataclasses.fields(kind)
)
"""Names of all these settings."""


def scalars_of(config: PpoConfig) -> PpoScalars:
    """Returns the numbers of one learner, as arrays of 32 bits."""
    return PpoScalars(**_values(PpoScalars, config))


def start_scalars_of(config: PpoConfig) -> StartScalars:
    """Returns those of its start."""
    return StartScalars(**_values(StartScalars, config))


def starting(config: PpoConfig, own: StartScalars) -> PpoConfig:
    """Returns `config` with the numbers of one member's start, which may be traced."""
    names = [field.name for field in dataclasses.fields(StartScalars)]
    return dataclasses.replace(config, **{name: getattr(own, name) for name in names})


def _values(kind: type, config: PpoConfig) -> dict[str, Array]:
    names = [field.name for field in dataclasses.fields(kind)]
    return {name: jnp.float32(getattr(config, name)) for name in names}
