"""Error that the controller ignores."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, state, x, dt):
    excess = jnp.maximum(jnp.abs(x.error) - params["half_width_rad"], 0.0)
    return state, x.replace(error=jnp.sign(x.error) * excess)


EFFECT = EffectKind(
    name="deadband",
    equation="e' = sign(e) max(|e| − d, 0)",
    parameters={
        "half_width_rad": Parameter("rad", 0.0, 0.2, lognormal(0.01, 2.5), identity=0.0)
    },
    acts={Stage.ERROR: _act},
    confusable_with={
        "coulomb_friction": "another kp: the zone of friction shrinks as 1/kp; or "
        "effort at rest, which is exactly 0 in a deadband",
        "backlash": "pull from outside with the deadband off",
        "start_torque": "effort at its edge: from 0 on, or with a jump",
        "stiffness": "holds under two loads",
        "hysteresis": "small loops: a deadband does not spring back",
        "command_quantization": "slow ramp: stairs stand at fixed commands",
    },
    source="G. Tao, P. Kokotović, Adaptive Control of Systems with Actuator and "
    "Sensor Nonlinearities, Wiley 1996",
)
