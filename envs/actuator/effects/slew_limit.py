"""Largest speed of the command."""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def limited(
    last: Float[Array, "*j"],
    command: Float[Array, "*j"],
    speed_rad_s: Float[ArrayLike, "*#j"],
    dt: float | Float[Array, "*j"],
) -> Float[Array, "*j"]:
    """Moves towards the command: c' = clip(u, c ± v_max Δt) [rad].

    Args:
        last: c, of the substep before [rad].
        command: u [rad].
        speed_rad_s: v_max [rad/s], > 0; infinite: no limit.
        dt: substep Δt [s].

    Source:
        Paper, command path.
    """
    reach = speed_rad_s * dt
    return jnp.clip(command, last - reach, last + reach)


def _act(params: Params, last, x, dt):
    speed = params["speed_rad_s"]
    command = limited(last, x.command, speed, dt)
    rising, falling = (jnp.minimum(v, speed) for v in (x.rising, x.falling))
    return command, x.replace(command=command, rising=rising, falling=falling)


EFFECT = EffectKind(
    name="slew_limit",
    equation="|ċ| ≤ v_max",
    parameters={
        "speed_rad_s": Parameter(
            "rad/s", 0.05, 50.0, lognormal(3.0, 2.0), identity=float("inf")
        )
    },
    acts={Stage.PROFILE: _act},
    confusable_with={
        "acceleration_limit": "steps of two sizes: only at a limit of the speed is the "
        "middle of a large one a ramp of the same slope",
        "directional_slew": "steps both ways: one limit is the same in both",
        "lowpass_cutoff": "steps of two sizes: the slope of a limit stays the same",
        "torque_limit": "effort: flat at a torque limit, small at a speed limit",
        "viscous_friction": "effort at constant speed: friction needs it, a limit not",
        "transport_delay": "steps of two sizes: the lag of a limit grows with the size",
    },
    source="Paper, Table I (filtered joint speed 2.8 and 2.5 rad/s)",
    init=lambda params, target, q, dt: target,
)
