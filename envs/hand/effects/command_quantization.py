"""Commands in whole steps of a register."""

import jax.numpy as jnp

from envs.hand.effects.base import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, state, x, dt):
    """Rounds to the nearest step; a step of zero leaves the command as it is."""
    step = params["step_rad"]
    safe = jnp.where(step > 0.0, step, 1.0)
    rounded = jnp.round(x.command / safe) * safe
    return state, x.replace(command=jnp.where(step > 0.0, rounded, x.command))


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
