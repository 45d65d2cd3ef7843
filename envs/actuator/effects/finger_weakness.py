"""A finger whose drives give less, or more, than those of the others."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, state, x, dt):
    strength = params["strength"]
    return state, x.replace(torque=strength * x.torque, follows=strength * x.follows)


def _change(params: Params, scene, fields):
    """Scales gains and limits of the position drives, which is the same."""
    strength = jnp.asarray(params["strength"])[..., None]
    names = ("actuator_gainprm", "actuator_biasprm", "actuator_forcerange")
    return fields | {name: fields[name] * strength for name in names}


EFFECT = EffectKind(
    name="finger_weakness",
    equation="τ' = s τ, gain and limit alike",
    parameters={
        "strength": Parameter("1", 0.05, 2.0, lognormal(1.0, 1.2), identity=1.0)
    },
    acts={Stage.TORQUE: _act},
    confusable_with={
        "stiffness": "amplitude: weakness also lowers the limit",
        "torque_limit": "small motions: a limit leaves them alone",
        "thermal_derating": "the same motion before and after a warm-up",
        "payload_com": "lift one finger after the other",
        "tip_friction": "press and pull each tip: a weak finger presses less",
    },
    source="ours; a scale of motor strength as in A. Kumar et al., RMA: Rapid Motor "
    "Adaptation for Legged Robots, RSS 2021",
    changes_model=_change,
)
