"""A floor that is not level."""

from envs.actuator.effect import EffectKind, Parameter, Params, normal
from envs.actuator.effects.mount_tilt import tilted

GRAVITY = "opt.gravity"


def _change(params: Params, scene, fields):
    """Turns gravity: the world's z stays the normal of the floor."""
    gravity = tilted(fields[GRAVITY], params["roll_rad"], params["pitch_rad"])
    return fields | {GRAVITY: gravity}


_ANGLE = Parameter("rad", -0.3, 0.3, normal(0.0, 0.02), identity=0.0)

EFFECT = EffectKind(
    name="floor_tilt",
    equation="g = R(roll, pitch)ᵀ g₀ in the frame of the floor",
    parameters={"roll_rad": _ANGLE, "pitch_rad": _ANGLE},
    acts={},
    confusable_with={
        "payload_com": "turn the hand: a tilt stays in the world",
        "friction_anisotropy": "turn the hand: both stay in the world; stand still: "
        "only a tilt pulls",
        "imu_misalignment": "turn the hand: an IMU turns with it",
    },
    source="ours, gravity in a turned frame",
    changes_model=_change,
    scope="hand",
)
