"""Largest rate at which the drive changes its torque, which starts at zero."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, last, x, dt):
    reach = params["slope_nm_s"] * dt
    torque = jnp.clip(x.torque, last - reach, last + reach)
    follows = jnp.where(torque == x.torque, x.follows, 0.0)
    return torque, x.replace(torque=torque, follows=follows)


EFFECT = EffectKind(
    name="torque_slope_limit",
    equation="|τ̇| ≤ S",
    parameters={
        "slope_nm_s": Parameter(
            "N·m/s", 1e-2, 1e4, lognormal(20.0, 4.0), identity=float("inf")
        )
    },
    acts={Stage.TORQUE: _act},
    confusable_with={
        "transport_delay": "steps of two sizes, in the effort: ramps of one slope",
        "lowpass_cutoff": "steps of two sizes, in the effort: ramps of one slope",
        "torque_limit": "effort during a long push: it goes on rising to the demand",
    },
    source="WUJI hand, firmware parameter TorqueSlopeLimitPerCycle",
    init=lambda params, target, q, dt: jnp.zeros_like(q),
)
