"""Motion of one joint with dry friction that sticks, for logs of single joints.

In the physics of the hand the same figures are the `frictionloss`, `damping` and
`armature` of the joint, which MuJoCo solves as a constraint in the same way: friction
opposes motion with at most its bound and stops it, but never turns it round.
"""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from envs.hand.effects.base import Substep


def joint_step(
    x: Substep, inertia: Float[ArrayLike, "*j"], dt: float
) -> tuple[Float[Array, "*j"], Float[Array, "*j"]]:
    """Advances angle and speed of a joint by one substep.

        (I + Δt b) v* = I v + Δt (τ + τ_load)
        v' = sign(v*) max(|v*| − Δt F / (I + Δt b), 0),   q' = q + Δt v'

    Semi-implicit Euler, friction implicit: with bounds F ≥ 0 and b ≥ 0 it takes energy
    at any Δt, and a joint sticks exactly while |τ + τ_load| ≤ F.

    Args:
        x: signals from `chain_step`.
        inertia: inertia of the joint without the drive [kg·m²], > 0.
        dt: substep [s].

    Returns:
        Angle [rad] and speed [rad/s] after the substep.
    """
    total = inertia + x.inertia
    heavy = total + dt * x.viscous
    free = (total * x.qd + dt * (x.torque + x.load)) / heavy
    speed = jnp.sign(free) * jnp.maximum(jnp.abs(free) - dt * x.friction / heavy, 0.0)
    return x.q + dt * speed, speed
