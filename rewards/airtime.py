"""Feet air time: Isaac Lab's reward for long swings, paid at touchdown."""

import flax.struct
import jax.numpy as jnp
from jaxtyping import Array, Float

from rewards.gates import FORCE_THRESHOLD_N, in_contact
from rewards.shaping import Number, Scalar, safe_norm


@flax.struct.dataclass
class AirTimeParams:
    """Constants of the air-time term.

    The first two are those of Isaac Lab's ANYmal-D flat task. They suit a quadruped
    that walks at up to 1 m/s; the crawl command ends at 0.16 m/s per axis.

    Attributes:
        threshold_s: T₀, swing that pays nothing; longer ones pay.
        command_threshold_mps: commanded planar speed that must be exceeded.
        force_threshold_n: F_th, see `rewards.gates.in_contact`.
    """

    threshold_s: Number = 0.5
    command_threshold_mps: Number = 0.1
    force_threshold_n: Number = FORCE_THRESHOLD_N


@flax.struct.dataclass
class AirTimeMemory:
    """What the air-time term carries; fresh at every episode start.

    Attributes:
        air_time_s: time since each tip left the ground [s]; 0 in contact.
    """

    air_time_s: Float[Array, "*b tips"]


def init_air_time_memory(tips: int = 5) -> AirTimeMemory:
    """Memory at the start of an episode; a tip that starts in contact did not land."""
    return AirTimeMemory(air_time_s=jnp.zeros((tips,)))


def air_time_step(
    memory: AirTimeMemory,
    tip_force_n: Float[Array, " tips"],
    command_planar: Float[Array, "2"],
    dt_s: Scalar,
    params: AirTimeParams,
) -> tuple[AirTimeMemory, Float[Array, ""]]:
    """One control step of feet air time, [|v_cmd| > v₀] Σ_j landed_j (T_j − T₀).

    T_j runs while tip j is airborne, including the interval in which it lands, as in
    Isaac Lab's contact sensor. This is the one kernel whose value may be negative, as
    in Isaac Lab: a touchdown after a swing shorter than T₀ is a loss.

    Args:
        memory: memory of the step before.
        tip_force_n: contact force magnitudes [N].
        command_planar: commanded planar velocity [m/s].
        dt_s: control interval [s], > 0.
        params: thresholds T₀, v₀ and F_th.

    Returns:
        New memory and value [s], ≥ −tips · T₀.

    Source:
        Isaac Lab, `feet_air_time` of the velocity tasks.
    """
    contact = in_contact(tip_force_n, params.force_threshold_n)
    air_time_s = memory.air_time_s + dt_s
    landed = contact & (memory.air_time_s > 0.0)
    paid_s = jnp.sum(jnp.where(landed, air_time_s - params.threshold_s, 0.0))
    commanded = safe_norm(command_planar) > params.command_threshold_mps
    kept = AirTimeMemory(air_time_s=jnp.where(contact, 0.0, air_time_s))
    return kept, jnp.where(commanded, paid_s, 0.0)
