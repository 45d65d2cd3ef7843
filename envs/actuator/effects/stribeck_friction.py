"""Dry friction that is larger at rest and falls with speed."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, state, x, dt):
    extra = params["extra_nm"] * jnp.exp(-((x.qd / params["speed_rad_s"]) ** 2))
    return state, x.replace(friction=x.friction + extra)


EFFECT = EffectKind(
    name="stribeck_friction",
    equation="F = F_s exp(−(q̇ / v_s)²), beside Coulomb friction",
    parameters={
        "extra_nm": Parameter("N·m", 0.0, 10.0, lognormal(0.02, 3.0), identity=0.0),
        "speed_rad_s": Parameter("rad/s", 1e-3, 10.0, lognormal(0.1, 3.0)),
    },
    acts={Stage.FRICTION: _act},
    confusable_with={
        "coulomb_friction": "slow ramps at four speeds: the dip of force over speed",
        "backlash": "ramps without reversal",
        "command_quantization": "slow ramps at two speeds",
        "hysteresis": "motions smaller than the presliding range",
    },
    source="B. Armstrong-Hélouvry et al., Automatica 30(7), 1994; "
    "C. Canudas de Wit et al., IEEE Trans. Automatic Control 40(3), 1995",
)
