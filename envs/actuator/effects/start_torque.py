"""Torque with which a servo starts wherever its error is not too small."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, state, x, dt):
    pushes = jnp.abs(x.error) > params["from_rad"]
    start = jnp.where(pushes, params["torque_nm"] * jnp.sign(x.error), 0.0)
    return state, x.replace(torque=x.torque + start)


EFFECT = EffectKind(
    name="start_torque",
    equation="τ' = τ + S sign(e) where |e| > e₀",
    parameters={
        "torque_nm": Parameter("N·m", 0.0, 10.0, lognormal(0.02, 3.0), identity=0.0),
        "from_rad": Parameter("rad", 1e-4, 0.2, lognormal(0.002, 2.5)),
    },
    acts={Stage.TORQUE: _act},
    confusable_with={
        "stiffness": "amplitude: a start torque does not grow with the error",
        "coulomb_friction": "effort: a start torque is in it, friction is not",
        "deadband": "effort beside it: a deadband begins at 0, a start torque jumps",
    },
    source="Feetech, STS3215 memory table (minimum startup force, address 24)",
)
