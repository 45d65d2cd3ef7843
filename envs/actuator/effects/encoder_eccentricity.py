"""Encoder disc or magnet off the axis: an error once per turn."""

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, normal
from envs.actuator.trigonometry import sine_cosine


def _act(params: Params, state, x, dt):
    """Sine and cosine instead of size and phase: both vanish at 0 and fit linearly."""
    sine, cosine = params["sine_rad"], params["cosine_rad"]
    sin_q, cos_q = sine_cosine(x.q)
    slope = 1.0 + sine * cos_q - cosine * sin_q
    shift = sine * sin_q + cosine * cos_q
    speed = x.encoder_speed * slope
    return state, x.replace(encoder=x.encoder + shift, encoder_speed=speed)


_PART = Parameter("rad", -0.2, 0.2, normal(0.0, 0.02), identity=0.0)

EFFECT = EffectKind(
    name="encoder_eccentricity",
    equation="y = q + a sin q + b cos q, inside the servo's loop",
    parameters={"sine_rad": _PART, "cosine_rad": _PART},
    acts={Stage.ENCODER: _act},
    confusable_with={
        "encoder_scale": "slow sweep of the range: straight against periodic",
        "encoder_offset": "slow sweep of the range: constant against periodic",
        "payload_com": "another load",
    },
    source="ours, from the geometry of a disc whose centre lies off the axis",
)
