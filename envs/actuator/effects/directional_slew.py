"""Largest speed of the command, another one in each direction."""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def towards(
    gap: Float[Array, "*j"],
    up_rad_s: Float[ArrayLike, "*#j"],
    down_rad_s: Float[ArrayLike, "*#j"],
) -> Float[Array, "*j"]:
    """|ċ| ≤ v₊ where the command has to rise, else v₋ [rad/s].

    Args:
        gap: goal less command [rad].
        up_rad_s: v₊ [rad/s], > 0; infinite: no limit.
        down_rad_s: v₋ [rad/s], likewise.

    Source:
        Ours.
    """
    return jnp.where(gap > 0.0, up_rad_s, down_rad_s)


def _act(params: Params, last, x, dt):
    gap, up, down = x.command - last, params["up_rad_s"], params["down_rad_s"]
    reach = towards(gap, up, down) * dt
    command = last + jnp.clip(gap, -reach, reach)
    rising, falling = jnp.minimum(x.rising, up), jnp.minimum(x.falling, down)
    return command, x.replace(command=command, rising=rising, falling=falling)


_SPEED = Parameter("rad/s", 0.05, 50.0, lognormal(3.0, 2.0), identity=float("inf"))

EFFECT = EffectKind(
    name="directional_slew",
    equation="−v₋ ≤ ċ ≤ v₊",
    parameters={"up_rad_s": _SPEED, "down_rad_s": _SPEED},
    acts={Stage.PROFILE: _act},
    confusable_with={
        "acceleration_limit": "steps of two sizes, both ways: a speed limit's slope is "
        "the same from the first moment",
        "slew_limit": "steps both ways: one limit is the same in both",
        "asymmetric_viscous": "effort at constant speed: friction needs it",
        "torque_limit": "effort: flat at a torque limit, small at a speed limit",
    },
    source="Robotis, e-Manual of the Dynamixel X series (profile velocity); that it "
    "may differ by direction: ours",
    init=lambda params, target, q, dt: target,
)
