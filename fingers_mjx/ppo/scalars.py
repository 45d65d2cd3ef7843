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


SCALARS = tuple(field.name for field in dataclasses.fields(PpoScalars))
"""Names of these settings."""
AT_START = ("learning_rate", "init_noise_std", "init_mean_scale")
"""Settings that only the state at the start depends on."""


def scalars_of(config: PpoConfig) -> PpoScalars:
    """Returns the numbers of one learner, as arrays of 32 bits."""
    values = {name: jnp.float32(getattr(config, name)) for name in SCALARS}
    return PpoScalars(**values)
