"""Fingertips that grip more or less than assumed."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, lognormal


def _change(params: Params, scene, fields):
    """Scales the sliding friction of each fingertip's sphere and capsule."""
    scale = jnp.broadcast_to(params["scale"], (len(scene.tip_geoms),))
    tips = jnp.array(scene.tip_geoms)
    friction = fields["geom_friction"].at[tips, 0].multiply(scale[:, None])
    return fields | {"geom_friction": friction}


EFFECT = EffectKind(
    name="tip_friction",
    equation="μ = s μ₀, per finger",
    parameters={"scale": Parameter("1", 0.1, 4.0, lognormal(1.0, 1.3), identity=1.0)},
    acts={},
    confusable_with={
        "friction_anisotropy": "pull in four directions",
        "finger_weakness": "press and pull each tip: a weak finger presses less",
    },
    source="Paper, Table I (kinetic friction 0.80 to 0.97 over three loaded pulls)",
    changes_model=_change,
    scope="finger",
)
