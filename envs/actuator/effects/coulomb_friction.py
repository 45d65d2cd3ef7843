"""Dry friction of constant size."""

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, state, x, dt):
    return state, x.replace(friction=x.friction + params["torque_nm"])


EFFECT = EffectKind(
    name="coulomb_friction",
    equation="F = F_c",
    parameters={
        "torque_nm": Parameter("N·m", 0.0, 10.0, lognormal(0.02, 3.0), identity=0.0)
    },
    acts={Stage.FRICTION: _act},
    confusable_with={
        "start_torque": "effort: a start torque is in it, friction is not",
        "deadband": "another kp, or effort at rest",
        "load_friction": "the same motion under two loads",
        "stribeck_friction": "slow ramps at four speeds",
        "hysteresis": "motions smaller than the presliding range",
        "backlash": "motor torque while the joint is pulled through the gap",
    },
    source="C. Canudas de Wit et al., A New Model for Control of Systems with "
    "Friction, IEEE Trans. Automatic Control 40(3), 1995",
)
