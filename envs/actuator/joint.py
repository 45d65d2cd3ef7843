"""Motion of one joint with dry friction that sticks, for logs of single joints.

In the physics of the hand the same quantities are `frictionloss`, `damping` and
`armature` of the joint and the velocity gain of its actuator. MuJoCo solves friction as
a constraint in the same way: it opposes motion with at most its bound and stops it, but
never turns it round; and it takes damping and velocity gain implicitly.
"""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from envs.actuator.effect import Substep


def joint_step(
    x: Substep, inertia: Float[ArrayLike, "*j"], dt: float
) -> tuple[Float[Array, "*j"], Float[Array, "*j"]]:
    """Advances angle and speed of a joint by one substep.

        H = I + Δt (b + d),   v* = v + Δt (τ + τ_passive + τ_load − b v) / H
        v' = sign(v*) max(|v*| − Δt F / H, 0),   q' = q + Δt v'

    with the drive's damping d = −∂τ/∂v. Semi-implicit Euler, friction and damping
    implicit: with bounds F ≥ 0 and b ≥ 0 friction takes energy at any Δt, and a joint
    sticks exactly while |τ + τ_passive + τ_load| ≤ F.

    Args:
        x: signals from `chain_step`.
        inertia: inertia of the joint without the drive [kg·m²], > 0.
        dt: substep [s].

    Returns:
        Angle [rad] and speed [rad/s] after the substep.

    Source:
        Ours, after MuJoCo's implicit integration of damping and its dry friction as a
        bounded constraint (MuJoCo documentation, Computation).
    """
    total = jnp.maximum(inertia + x.inertia, 0.0)
    heavy = total + dt * (x.viscous + x.damping)
    torque = x.torque + x.passive + x.load
    free = x.qd + dt * (torque - x.viscous * x.qd) / heavy
    speed = jnp.sign(free) * jnp.maximum(jnp.abs(free) - dt * x.friction / heavy, 0.0)
    return x.q + dt * speed, speed
