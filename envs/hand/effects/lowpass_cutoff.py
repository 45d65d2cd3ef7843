"""First-order low-pass of the target in the firmware."""

import jax.numpy as jnp

from envs.hand.effects.base import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, filtered, x, dt):
    """Exact for a command that is held over the substep."""
    alpha = -jnp.expm1(-2.0 * jnp.pi * params["cutoff_hz"] * dt)
    filtered = filtered + alpha * (x.command - filtered)
    return filtered, x.replace(command=filtered)


EFFECT = EffectKind(
    name="lowpass_cutoff",
    equation="ċ = 2π f_c (u − c)",
    parameters={
        "cutoff_hz": Parameter(
            "Hz", 0.1, 200.0, lognormal(5.0, 2.5), identity=float("inf")
        )
    },
    acts={Stage.COMMAND: _act},
    confusable_with={
        "transport_delay": "steps: a filter moves at once; chirp: its gain falls",
        "slew_limit": "steps of two sizes: a filter scales with the size",
        "damping": "set the firmware's filter to another cutoff: the estimate follows",
        "viscous_friction": "set the firmware's filter to another cutoff",
        "torque_slope_limit": "steps of two sizes, in the effort: ramps of one slope",
    },
    source="Paper, command path (3 Hz position filter of the firmware)",
    init=lambda params, target, q, dt: target,
)
