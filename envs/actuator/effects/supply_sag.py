"""A supply whose voltage falls under load: all joints weaken together, at once."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, state, x, dt):
    """Divides the torque by what all joints on the supply ask for.

    With inner resistance R, currents I_i = K V d_i / V₀ for demands d_i leave
    V / V₀ = 1 / (1 + s Σ d_i), s = R K / V₀. A joint that asks for more lowers its own
    share too: it follows with the slope of τ / (1 + s Σ).
    """
    others = x.around.others_nm
    own = jnp.abs(x.torque)
    asked = own + (0.0 if others is None else others)
    left = 1.0 / (1.0 + params["sag_per_nm"] * asked)
    slope = left * (1.0 - params["sag_per_nm"] * own * left)
    return state, x.replace(torque=left * x.torque, follows=slope * x.follows)


EFFECT = EffectKind(
    name="supply_sag",
    equation="τ' = τ / (1 + s Σ_i |τ_i|), over all joints on the supply",
    parameters={
        "sag_per_nm": Parameter("1/(N·m)", 0.0, 1e3, lognormal(0.05, 4.0), identity=0.0)
    },
    acts={Stage.TORQUE: _act},
    confusable_with={
        "torque_limit": "bus voltage, or one joint alone against all together",
        "thermal_derating": "a pause: a supply recovers at once, a winding in minutes",
        "stiffness": "one joint alone against all together",
    },
    source="ours, from the circuit of a source with an inner resistance; dependence of "
    "a servo's torque on its voltage: M. Duclusaud et al., arXiv 2410.08650",
)
