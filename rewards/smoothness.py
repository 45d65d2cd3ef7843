"""Smoothness of the policy's output."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def action_rate(
    action: Float[Array, " joints"], previous_action: Float[Array, " joints"]
) -> Float[Array, ""]:
    """Sum of squared changes of the action, Σ (a_t − a_{t−1})².

    Args:
        action: clipped policy output of this step, before tanh; dimensionless.
        previous_action: clipped policy output of the step before.

    Returns:
        Magnitude, dimensionless, ≥ 0. Not divided by the control interval.

    Source:
        Paper, action rate; the norm is that of Isaac Lab, `action_rate_l2`.
    """
    return jnp.sum(jnp.square(action - previous_action))
