"""Largest acceleration of the command: a trapezoidal profile of the servo's own."""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal

STILL = 1e-30
"""Least square of a peak's speed, so that a command at rest has a slope [(rad/s)²]."""


def profiled(
    gap: Float[Array, "*j"],
    speed: Float[Array, "*j"],
    fastest: tuple[Float[ArrayLike, "*#j"], Float[ArrayLike, "*#j"]],
    acceleration: Float[ArrayLike, "*#j"],
    dt: float | Float[Array, "*#j"],
) -> tuple[Float[Array, "*j"], Float[Array, "*j"]]:
    """Goes on in the least time towards rest at a goal that is held: |ẇ| ≤ a, |w| ≤ v.

    Seen in the direction s in which the goal lies from where braking would end,
    s = sign(x − w |w| / 2a), the speed rises to the peak p, stays, and falls to 0:

        p = min(v_s, √(a s x + w² / 2)),   T₁ = (p − s w) / a,   T₃ = p / a
        T₂ = (s x − (2 p² − w²) / 2a) / p

    Exact at any step: while it falls, w = a r and x = a r² / 2 with the time r that is
    left of T₁ + T₂ + T₃.

    Args:
        gap: goal less command, x [rad].
        speed: of the command, w [rad/s].
        fastest: largest speeds v up and down [rad/s], > 0; infinite: no limit.
        acceleration: a [rad/s²], > 0 and finite.
        dt: step [s].

    Returns:
        Gap [rad] and speed [rad/s] after the step.

    Source:
        Time-optimal control of a double integrator: A. Bryson, Y. Ho, Applied Optimal
        Control, 1975; as profiles of drives: L. Biagiotti, C. Melchiorri, Trajectory
        Planning for Automatic Machines and Robots, 2008, section 3.2.
    """
    beyond = gap - 0.5 * speed * jnp.abs(speed) / acceleration
    way = jnp.where(beyond >= 0.0, 1.0, -1.0)
    top = jnp.where(beyond >= 0.0, *fastest)
    x, w = way * gap, way * speed
    free = jnp.sqrt(jnp.maximum(acceleration * x + 0.5 * w**2, STILL))
    peak = jnp.minimum(free, top)
    rises_s, falls_s = (peak - w) / acceleration, peak / acceleration
    rest = x - (peak**2 - 0.5 * w**2) / acceleration
    stays_s = jnp.where(free > top, rest, 0.0) / peak
    left_s = jnp.maximum(rises_s + stays_s + falls_s - dt, 0.0)
    rising_s = jnp.minimum(rises_s, dt)
    passed = (w + 0.5 * acceleration * rising_s) * rising_s + peak * (dt - rising_s)
    falls = left_s < falls_s
    x = jnp.where(falls, 0.5 * acceleration * left_s**2, x - passed)
    w = jnp.where(falls, acceleration * left_s, w + acceleration * rising_s)
    return way * x, way * w


def _act(params: Params, state, x, dt):
    """Follows the goal where there is a limit, and else the command as it is."""
    command, speed = state
    some = jnp.isfinite(params["acceleration_rad_s2"])
    acceleration = jnp.where(some, params["acceleration_rad_s2"], 1.0)
    fastest = x.rising, x.falling
    gap, speed = profiled(x.goal - command, speed, fastest, acceleration, dt)
    command = jnp.where(some, x.goal - gap, x.command)
    return (command, jnp.where(some, speed, 0.0)), x.replace(command=command)


EFFECT = EffectKind(
    name="acceleration_limit",
    equation="|c̈| ≤ a, at rest where it arrives: |ċ| ≤ √(2 a |u − c|)",
    parameters={
        "acceleration_rad_s2": Parameter(
            "rad/s²", 0.1, 5000.0, lognormal(20.0, 3.0), identity=float("inf")
        )
    },
    acts={Stage.PROFILE: _act},
    confusable_with={
        "slew_limit": "steps of two sizes: only at a limit of the speed is the middle "
        "of a large one a ramp of the same slope",
        "directional_slew": "steps of two sizes, both ways: a speed limit's slope is "
        "the same from the first moment",
        "lowpass_cutoff": "steps of two sizes: a filter takes as long for both",
        "transport_delay": "steps of two sizes: the lag of a limit grows with the size",
        "torque_limit": "effort: flat at a torque limit, else that of the motion",
    },
    source="Robotis, e-Manual of the Dynamixel X series (profile acceleration); "
    "Feetech, STS3215 memory table (goal acceleration, address 41)",
    init=lambda params, target, q, dt: (target, jnp.zeros_like(target)),
)
