"""A motor that gets weaker as its winding warms up."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, loss, x, dt):
    """Warms by the square of the torque and gives the torque that is left.

    Exact for a torque that is held over the substep. Gain and limit fall alike, as they
    do where a voltage drives a winding whose resistance grows.
    """
    left = 1.0 / (1.0 + loss)
    torque = left * x.torque
    warmth = params["loss_per_nm2"] * torque**2
    loss = loss - jnp.expm1(-dt / params["time_constant_s"]) * (warmth - loss)
    return loss, x.replace(torque=torque, follows=left * x.follows)


EFFECT = EffectKind(
    name="thermal_derating",
    equation="τ' = τ / (1 + w), T ẇ = k τ'² − w; cold at the start",
    parameters={
        "loss_per_nm2": Parameter(
            "1/(N·m)²", 0.0, 1e6, lognormal(1.0, 4.0), identity=0.0
        ),
        "time_constant_s": Parameter("s", 1.0, 2000.0, lognormal(60.0, 3.0)),
    },
    acts={Stage.TORQUE: _act},
    confusable_with={
        "torque_limit": "cold against warm: a limit does not drift",
        "stiffness": "the same motion before and after a warm-up, and after a pause",
        "supply_sag": "a pause: a supply recovers at once, a winding in minutes",
        "finger_weakness": "the same motion before and after a warm-up",
    },
    source="S. Trujillo, M. Cutkosky, Thermally Constrained Motor Operation for a "
    "Climbing Robot, ICRA 2009 (winding temperature from current)",
    init=lambda params, target, q, dt: jnp.zeros_like(q),
)
