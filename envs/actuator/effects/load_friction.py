"""Dry friction that grows with the torque through the gears."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal

_SHARE = Parameter("1", 0.0, 1.0, lognormal(0.1, 2.5), identity=0.0)
_DRIVE = Parameter("1", 0.0, 0.8, lognormal(0.1, 2.5), identity=0.0)
"""Gears that keep more of the torque than that move nothing."""


def _act(params: Params, state, x, dt):
    drive, load = params["drive_share"] * x.torque, params["load_share"] * x.load
    return state, x.replace(friction=x.friction + jnp.abs(drive - load))


EFFECT = EffectKind(
    name="load_friction",
    equation="F = |K_m τ − K_e τ_load|; with K_m = K_e independent of direction",
    parameters={"drive_share": _DRIVE, "load_share": _SHARE},
    acts={Stage.FRICTION: _act},
    confusable_with={
        "coulomb_friction": "the same motion under three loads or with three kp",
        "stiffness": "loaded motion both ways: friction opens a loop",
        "torque_limit": "effort: a limit is flat",
    },
    source="M. Duclusaud et al., Extended Friction Models for the Physics Simulation "
    "of Servo Actuators, arXiv 2410.08650 (models M3 and M5)",
    uses_load=True,
)
