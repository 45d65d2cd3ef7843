"""Tracking of the mean velocity: what is left of the error beyond the sway of a stride.

Within a stride the palm swings by more than the error that counts. The kernels of
`rewards.tracking` see the sway, and are flat where the mean is far from its command.
"""

import flax.struct
import jax.numpy as jnp
from jaxtyping import Array, Float

from rewards.shaping import Scalar, safe_norm
from rewards.tracking import PLANAR_WIDTH_MPS, YAW_WIDTH_RADPS

MEAN_TAU_S = 0.5
"""Time constant of the mean [s] (ours): a sway of 2 Hz is left with a sixth."""


@flax.struct.dataclass
class MeanErrorMemory:
    """What the mean carries; fresh at every episode start and command resampling.

    Attributes:
        error: ē, mean error of v_x, v_y [m/s] and yaw rate [rad/s] in V.
    """

    error: Float[Array, "*b 3"]


def init_mean_error_memory() -> MeanErrorMemory:
    """Memory at the start of an episode or of a command: no error yet."""
    return MeanErrorMemory(error=jnp.zeros((3,)))


def mean_error_step(
    memory: MeanErrorMemory,
    vel_v: Float[Array, "3"],
    angvel_v: Float[Array, "3"],
    command: Float[Array, "3"],
    dt_s: Scalar,
    tau_s: Scalar = MEAN_TAU_S,
) -> tuple[MeanErrorMemory, Float[Array, "3"]]:
    """One control step of the mean error, ē ← (1 − α) ē + α (v − v_cmd).

    α = Δt/(Δt + τ), and v = (v_x, v_y, ω_z).

    Args:
        memory: memory of the step before.
        vel_v: linear velocity of the palm in V [m/s].
        angvel_v: angular velocity of the palm in V [rad/s]; only z is read.
        command: v_x, v_y [m/s] and yaw rate [rad/s] in V.
        dt_s: control interval Δt [s], > 0.
        tau_s: τ [s].

    Returns:
        New memory and ē: x, y [m/s], yaw rate [rad/s].

    Source:
        Ours; the filter is that of the paper's eq. (2).
    """
    now = jnp.stack([vel_v[0], vel_v[1], angvel_v[2]]) - command
    alpha = dt_s / (dt_s + tau_s)
    error = (1.0 - alpha) * memory.error + alpha * now
    return MeanErrorMemory(error=error), error


def track_mean_planar_velocity(
    mean_error_v: Float[Array, "3"], width_mps: Scalar = PLANAR_WIDTH_MPS
) -> Float[Array, ""]:
    """Tracking of the planar command in the mean, exp(−|ē_xy|/w).

    Its slope does not vanish at a small error, nor as soon at a large one as that of a
    Gaussian.

    Args:
        mean_error_v: ē of `mean_error_step` [m/s, m/s, rad/s].
        width_mps: w [m/s], > 0.

    Returns:
        Magnitude in (0, 1].

    Source:
        Ours.
    """
    return jnp.exp(-safe_norm(mean_error_v[:2]) / width_mps)


def track_mean_yaw_rate(
    mean_error_v: Float[Array, "3"], width_radps: Scalar = YAW_WIDTH_RADPS
) -> Float[Array, ""]:
    """Tracking of the yaw command in the mean, exp(−|ē_ω|/w).

    Args:
        mean_error_v: ē of `mean_error_step` [m/s, m/s, rad/s].
        width_radps: w [rad/s], > 0.

    Returns:
        Magnitude in (0, 1].

    Source:
        Ours.
    """
    return jnp.exp(-safe_norm(mean_error_v[2:]) / width_radps)
