"""Largest torque of the drive, by current, voltage or setting."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, state, x, dt):
    """A drive at its limit does not depend on speed."""
    limit = params["limit_nm"]
    follows = jnp.where(jnp.abs(x.torque) >= limit, 0.0, x.follows)
    return state, x.replace(torque=jnp.clip(x.torque, -limit, limit), follows=follows)


EFFECT = EffectKind(
    name="torque_limit",
    equation="|τ| ≤ τ_max",
    parameters={
        "limit_nm": Parameter(
            "N·m", 1e-3, 100.0, lognormal(0.5, 3.0), identity=float("inf")
        )
    },
    acts={Stage.TORQUE: _act},
    confusable_with={
        "slew_limit": "effort: flat at a torque limit, small at a speed limit",
        "acceleration_limit": "effort: flat at a torque limit, else that of the motion",
        "directional_slew": "effort: flat at a torque limit, small at a speed limit",
        "supply_sag": "bus voltage, or one joint alone against all together",
        "thermal_derating": "cold against warm: a limit does not drift",
        "stiffness": "amplitude: a limit leaves small motions alone",
        "load_friction": "effort: a limit is flat",
        "torque_slope_limit": "effort during a long push: a slope goes on rising",
        "finger_weakness": "small motions: a limit leaves them alone",
    },
    source="Paper, drive (1.0 A for each joint)",
)
