"""Velocity gain other than assumed."""

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, state, x, dt):
    return state, x.replace(kd=x.kd * params["scale"])


EFFECT = EffectKind(
    name="damping",
    equation="kd = s kd₀",
    parameters={"scale": Parameter("1", 0.0, 50.0, lognormal(1.0, 2.0), identity=1.0)},
    acts={Stage.GAINS: _act},
    confusable_with={
        "viscous_friction": "drive off: the gain is gone, the friction remains",
        "lowpass_cutoff": "set the firmware's filter to another cutoff",
        "transport_delay": "chirp near resonance: damping lowers the peak",
    },
    source="M. Spong et al., Robot Modeling and Control, 2nd ed.",
)
