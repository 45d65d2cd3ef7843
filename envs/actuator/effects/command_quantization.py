"""Commands in whole steps of a register."""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def quantized(
    command: Float[Array, "..."], step_rad: Float[ArrayLike, "..."]
) -> Float[Array, "..."]:
    """Rounds to the nearest step: c = Δ round(u / Δ) [rad]; c = u for Δ = 0.

    Args:
        command: u [rad].
        step_rad: Δ [rad], ≥ 0.

    Source:
        K. Åström, B. Wittenmark, Computer-Controlled Systems, 3rd ed., 1997
        (quantization).
    """
    step_rad = jnp.asarray(step_rad)
    safe = jnp.where(step_rad > 0.0, step_rad, 1.0)
    return jnp.where(step_rad > 0.0, jnp.round(command / safe) * safe, command)


def _act(params: Params, state, x, dt):
    return state, x.replace(command=quantized(x.command, params["step_rad"]))


EFFECT = EffectKind(
    name="command_quantization",
    equation="c = Δ round(u / Δ)",
    parameters={
        "step_rad": Parameter("rad", 0.0, 0.2, lognormal(0.005, 3.0), identity=0.0)
    },
    acts={Stage.COMMAND: _act},
    confusable_with={
        "deadband": "slow ramp: stairs stand at fixed commands",
        "backlash": "slow ramp without reversal: backlash leaves no stairs",
        "stribeck_friction": "slow ramps at two speeds: stick-slip changes, stairs not",
    },
    source="B. Widrow, I. Kollár, Quantization Noise, Cambridge 2008",
)
