"""How far an episode is from its command, as pure functions of its time series.

Errors of means over a sliding window of one second: velocities swing within a stride.
As the other measures: arrays of one episode, a mask `alive`, NaN where an episode does
not define a measure. So a hand that falls within the first second has no error: read
them beside the survival.
"""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from fingers_mjx.evaluation.measures import masked_mean


def turn_rate_error_rad_s(
    yaw_rate: Float[Array, " T"],
    command_yaw_rate: Float[Array, " T"],
    alive: Bool[Array, " T"],
    dt_s: float,
    window_s: float = 1.0,
) -> Float[Array, ""]:
    """How far the heading rate is from its command [rad/s], at least 0.

    mean_t |(1/w) Σ_{s in t..t+w} (ω_s - c_s)|: the error of sliding one-second means,
    because the yaw rate swings within each stride. NaN for an episode shorter than the
    window.

    Source:
        Ours.
    """
    means = _sliding_means(yaw_rate - command_yaw_rate, alive, dt_s, window_s)
    return masked_mean(jnp.abs(means), alive[-len(means) :])


def planar_velocity_error_mps(
    vel_v: Float[Array, "T 2"],
    command: Float[Array, "T 3"],
    alive: Bool[Array, " T"],
    dt_s: float,
    window_s: float = 1.0,
) -> Float[Array, ""]:
    """How far the planar velocity is from its command, both in V [m/s], at least 0.

    mean_t ‖(1/w) Σ_{s in t..t+w} (v_s - c_s)‖: as `turn_rate_error_rad_s`; unlike the
    task speed it punishes what goes faster than is asked, and to the side of it. NaN
    for an episode shorter than the window.

    Source:
        Ours.
    """
    error = vel_v - command[:, :2]
    means = [_sliding_means(axis, alive, dt_s, window_s) for axis in error.T]
    size = jnp.linalg.norm(jnp.stack(means), axis=0)
    return masked_mean(size, alive[-len(size) :])


def _sliding_means(values: Array, alive: Array, dt_s: float, window_s: float) -> Array:
    """Returns means over a sliding window; one NaN for an episode that is shorter."""
    span = max(1, round(window_s / dt_s))
    if span > len(values):
        return jnp.full(1, jnp.nan, values.dtype)
    kernel = jnp.full(span, 1.0 / span, values.dtype)
    return jnp.convolve(jnp.where(alive, values, 0.0), kernel, mode="valid")
