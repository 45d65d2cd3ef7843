"""Zero of the encoder that is not the zero of the joint."""

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, normal


def _act(params: Params, state, x, dt):
    return state, x.replace(encoder=x.encoder + params["offset_rad"])


EFFECT = EffectKind(
    name="encoder_offset",
    equation="y = q + o, inside the servo's loop",
    parameters={
        "offset_rad": Parameter("rad", -1.5, 1.5, normal(0.0, 0.03), identity=0.0)
    },
    acts={Stage.ENCODER: _act},
    confusable_with={
        "mount_tilt": "holds in several postures: tilt turns with gravity",
        "payload_com": "another load",
        "asymmetric_friction": "at rest: an asymmetry of friction is gone",
        "encoder_eccentricity": "slow sweep of the range: constant against periodic",
    },
    source="J. Hollerbach et al., Model Identification, Springer Handbook of Robotics, "
    "2nd ed., ch. 6",
)
