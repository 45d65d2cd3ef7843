"""Encoder that counts too much or too little."""

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, state, x, dt):
    scale = params["scale"]
    return state, x.replace(
        encoder=scale * x.encoder, encoder_speed=scale * x.encoder_speed
    )


EFFECT = EffectKind(
    name="encoder_scale",
    equation="y = s q, inside the servo's loop",
    parameters={"scale": Parameter("1", 0.5, 2.0, lognormal(1.0, 1.03), identity=1.0)},
    acts={Stage.ENCODER: _act},
    confusable_with={
        "stiffness": "the whole range without load, or an angle measured from outside",
        "payload_mass": "the whole range without load",
        "encoder_eccentricity": "slow sweep of the range: straight against periodic",
    },
    source="J. Hollerbach et al., Model Identification, Springer Handbook of Robotics, "
    "2nd ed., ch. 6",
)
