"""Dry friction that differs between the two directions."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, normal


def _act(params: Params, state, x, dt):
    """A joint at rest has the friction of the direction it is pushed in.

    The sum of all dry friction stays ≥ 0, also where the difference is larger than
    what the other effects give.
    """
    push = jnp.where(x.qd == 0.0, x.torque + x.load, x.qd)
    friction = x.friction + 0.5 * jnp.sign(push) * params["difference_nm"]
    return state, x.replace(friction=jnp.maximum(friction, 0.0))


EFFECT = EffectKind(
    name="asymmetric_friction",
    equation="F = max(F_c + sign(q̇) D / 2, 0), beside Coulomb friction",
    parameters={
        "difference_nm": Parameter("N·m", -10.0, 10.0, normal(0.0, 0.02), identity=0.0)
    },
    acts={Stage.FRICTION: _act},
    confusable_with={
        "asymmetric_viscous": "ramps in both directions at several speeds",
        "mount_tilt": "at rest: an asymmetry of friction is gone",
        "encoder_offset": "at rest: an asymmetry of friction is gone",
    },
    source="A. Janot et al., Data Set and Reference Models of EMPS, Workshop on "
    "Nonlinear System Identification Benchmarks, 2019",
    uses_load=True,
)
