"""Generalized advantages, with the loop over time unrolled."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def compute_gae(
    *,
    truncation: Float[Array, "t b"],
    termination: Float[Array, "t b"],
    rewards: Float[Array, "t b"],
    values: Float[Array, "t b"],
    bootstrap_value: Float[Array, " b"],
    lambda_: Float[Array, ""] | float,
    discount: Float[Array, ""] | float,
) -> tuple[Float[Array, "t b"], Float[Array, "t b"]]:
    """Targets V⁺ of the critic and advantages Â, without gradients [reward].

    δ_t = m_t (r_t + γ c_t V_{t+1} - V_t); A_t = δ_t + γ λ c_t m_t A_{t+1}, A_T = 0;
    V⁺ = V + A; Â_t = m_t (r_t + γ c_t V⁺_{t+1} - V_t), V⁺_T = V_T. m is 0 where a step
    was truncated, c is 0 where it ended the episode, else 1 [1].

    What Brax's function of this name returns, which runs a loop of `t` turns: on a GPU
    that took half of the time of an update, since every turn waits for a launch.

    Source:
        Schulman et al., "High-Dimensional Continuous Control Using Generalized
        Advantage Estimation", ICLR 2016, eq. 16; Brax, `losses.compute_gae`.
    """
    valid, goes_on = 1.0 - truncation, 1.0 - termination
    following = jnp.concatenate([values[1:], bootstrap_value[None]])
    delta = (rewards + discount * goes_on * following - values) * valid

    def back(excess: Array, step: tuple[Array, Array]) -> tuple[Array, Array]:
        delta, carries = step
        excess = delta + carries * excess
        return excess, excess

    carries = discount * goes_on * valid * lambda_
    start = jnp.zeros_like(bootstrap_value)
    _, excess = jax.lax.scan(back, start, (delta, carries), reverse=True, unroll=True)
    targets = excess + values
    following = jnp.concatenate([targets[1:], bootstrap_value[None]])
    advantages = (rewards + discount * goes_on * following - values) * valid
    return jax.lax.stop_gradient(targets), jax.lax.stop_gradient(advantages)
