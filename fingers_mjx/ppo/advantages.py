"""Generalized advantages, with the loop over time unrolled."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

Scalar = Float[Array, ""] | float
STEPS_OF_A_TURN = 24
"""Of the loop over time: the whole rollout of the presets. Some hundred take minutes
to compile, and on a CPU they are slower than a loop (ours)."""


def generalized_advantages(
    rewards: Float[Array, "t b"],
    values: Float[Array, "t+1 b"],
    valid: Float[Array, "t b"],
    goes_on: Float[Array, "t b"],
    discount: Scalar,
    decay: Scalar,
) -> tuple[Float[Array, "t b"], Float[Array, "t b"]]:
    """Targets V⁺ of the critic and advantages Â, without gradients [reward].

    δ_t = m_t (r_t + γ c_t V_{t+1} - V_t); A_t = δ_t + γ λ c_t m_t A_{t+1}, A_T = 0;
    V⁺ = V + A; Â_t = m_t (r_t + γ c_t V⁺_{t+1} - V_t), V⁺_T = V_T. γ is the discount
    and λ the decay in [0, 1]; `valid` m is 0 where a step was truncated, `goes_on` c is
    0 where it ended the episode, else both are 1 [1].

    Brax does this with a loop of `t` turns, each of which waits for a launch on a GPU;
    here a turn does `STEPS_OF_A_TURN` steps, by which PPO is 4 % faster (8,192 worlds
    on one H200).

    Source:
        Schulman et al., "High-Dimensional Continuous Control Using Generalized
        Advantage Estimation", ICLR 2016, eq. 16; Brax, `losses.compute_gae`.
    """

    def back(excess: Array, step: tuple[Array, Array]) -> tuple[Array, Array]:
        delta, carries = step
        excess = delta + carries * excess
        return excess, excess

    def error(following: Array) -> Array:
        return (rewards + discount * goes_on * following - now) * valid

    now, last = values[:-1], values[-1:]
    delta = error(values[1:])
    carries = discount * goes_on * valid * decay
    start = jnp.zeros_like(values[-1])
    unroll = min(STEPS_OF_A_TURN, len(delta))
    _, excess = jax.lax.scan(back, start, (delta, carries), reverse=True, unroll=unroll)
    targets = excess + now
    advantages = error(jnp.concatenate([targets[1:], last]))
    return jax.lax.stop_gradient(targets), jax.lax.stop_gradient(advantages)
