"""A floor with a grain: friction differs along and across it."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, normal


def _change(params: Params, scene, fields):
    """Sets the two sliding coefficients of each pair of tip and floor.

    The contact frame of a sphere on a plane has its first tangent along the world's y.
    """
    pairs = jnp.array(scene.tip_pairs)
    spheres = jnp.array([sphere for sphere, _ in scene.tip_geoms])
    slide = fields["geom_friction"][spheres, 0]
    split = jnp.broadcast_to(params["split"], slide.shape)
    friction = (
        fields["pair_friction"]
        .at[pairs, 0]
        .set(slide * (1.0 - split))
        .at[pairs, 1]
        .set(slide * (1.0 + split))
    )
    return fields | {"pair_friction": friction}


EFFECT = EffectKind(
    name="friction_anisotropy",
    equation="μ_x = μ (1 + a), μ_y = μ (1 − a) along the x and y of the floor",
    parameters={"split": Parameter("1", -0.9, 0.9, normal(0.0, 0.1), identity=0.0)},
    acts={},
    confusable_with={
        "tip_friction": "pull in four directions",
        "floor_tilt": "turn the hand: both stay in the world; stand still: only a tilt "
        "pulls",
    },
    source="S. Walker, R. Leine, Set-Valued Anisotropic Dry Friction Laws, Nonlinear "
    "Dynamics 96, 2019 (friction that depends on the direction of sliding)",
    changes_model=_change,
    scope="hand",
)
