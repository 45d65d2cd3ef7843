"""First-order low-pass of the target in the firmware."""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def filtered(
    last: Float[Array, "..."],
    command: Float[Array, "..."],
    cutoff_hz: Float[ArrayLike, "..."],
    dt: float | Float[Array, "..."],
) -> Float[Array, "..."]:
    """Advances the low-pass, exactly for a command that is held over the substep.

    y' = y + (1 − e^{−2π f_c Δt}) (u − y) [rad]. Its time constant 1/(2πf_c) does not
    depend on Δt. The backward Euler factor Δt/(Δt + 1/2πf_c) of the vendor's host-side
    fallback does (4 % slower at 3 Hz and 200 Hz), while the firmware that it stands for
    runs much faster.

    Args:
        last: y [rad].
        command: u [rad].
        cutoff_hz: f_c [Hz], > 0; infinite: no filter.
        dt: substep Δt [s].

    Source:
        Paper, command path; K. Åström, B. Wittenmark, Computer-Controlled Systems, 3rd
        ed., 1997 (zero-order-hold sampling).
    """
    alpha = -jnp.expm1(-2.0 * jnp.pi * cutoff_hz * dt)
    return last + alpha * (command - last)


def _act(params: Params, last, x, dt):
    command = filtered(last, x.command, params["cutoff_hz"], dt)
    return command, x.replace(command=command)


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
        "acceleration_limit": "steps of two sizes: a filter takes as long for both",
        "slew_limit": "steps of two sizes: a filter scales with the size",
        "damping": "set the firmware's filter to another cutoff: the estimate follows",
        "viscous_friction": "set the firmware's filter to another cutoff",
        "torque_slope_limit": "steps of two sizes, in the effort: ramps of one slope",
    },
    source="Paper, command path (3 Hz position filter of the firmware)",
    init=lambda params, target, q, dt: target,
)
