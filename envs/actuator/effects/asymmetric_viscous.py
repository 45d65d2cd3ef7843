"""Viscous friction that differs between the two directions."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, normal


def _act(params: Params, state, x, dt):
    """The sum of all viscous friction stays ≥ 0."""
    viscous = x.viscous + 0.5 * jnp.sign(x.qd) * params["difference_nms"]
    return state, x.replace(viscous=jnp.maximum(viscous, 0.0))


EFFECT = EffectKind(
    name="asymmetric_viscous",
    equation="b' = max(b + sign(q̇) D / 2, 0), beside viscous friction",
    parameters={
        "difference_nms": Parameter(
            "N·m·s/rad", -10.0, 10.0, normal(0.0, 0.02), identity=0.0
        )
    },
    acts={Stage.FRICTION: _act},
    confusable_with={
        "directional_slew": "effort at constant speed: friction needs it",
        "asymmetric_friction": "ramps in both directions at several speeds",
        "viscous_friction": "ramps in both directions at several speeds",
    },
    source="ours; in the data of A. Janot et al., Data Set and Reference Models of "
    "EMPS, 2019, it explains what the reference model puts into an offset",
)
