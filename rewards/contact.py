"""Contacts: links that should not touch, tips that should not slide."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from rewards.gates import FORCE_THRESHOLD_N, in_contact
from rewards.shaping import Scalar, safe_norm

SLIPPERY = 0.25
"""μ of a floor on which no tip should slip, below what tasks draw by default; ours."""


def undesired_contact(link_contact: Float[Array, " links"]) -> Float[Array, ""]:
    """Number of links other than fingertips that touch the ground, Σ c.

    Args:
        link_contact: c, 1 for each link in contact, else 0 [1].

    Returns:
        Magnitude, a count in [0, links].

    Source:
        Paper, undesired contact; Isaac Lab, `undesired_contacts`.
    """
    return jnp.sum(link_contact)


def foot_slide(
    tip_vel_w: Float[Array, "tips 3"],
    tip_force_n: Float[Array, " tips"],
    force_threshold_n: Scalar = FORCE_THRESHOLD_N,
) -> Float[Array, ""]:
    """Horizontal speed of the tips in contact, Σ_j [F_j ≥ F_th] |v_xy,j|.

    Args:
        tip_vel_w: tip velocities in the world [m/s], z vertical.
        tip_force_n: contact force magnitudes [N].
        force_threshold_n: F_th [N].

    Returns:
        Magnitude [m/s], ≥ 0; 0 when planted tips stand still.

    Source:
        Isaac Lab, `feet_slide`.

    Examples:
        Only the tip in contact counts, the one in the air may move:

        >>> tips_vel_w = jnp.array([[0.03, 0.04, 0.0], [0.1, 0.0, 0.0]])
        >>> print(f"{foot_slide(tips_vel_w, jnp.array([1.0, 0.0])):.2f}")
        0.05
    """
    speed_mps = safe_norm(tip_vel_w[:, :2])
    return jnp.sum(jnp.where(in_contact(tip_force_n, force_threshold_n), speed_mps, 0))


def shear_excess(
    tip_shear_n: Float[Array, " tips"],
    tip_force_n: Float[Array, " tips"],
    friction: Scalar = SLIPPERY,
) -> Float[Array, ""]:
    """Force along the ground beyond the friction cone, Σ_j max(0, S_j − F_j sin φ).

    A cone of friction μ has the half angle φ = atan μ, so sin φ = μ/√(1 + μ²). What
    a slippery floor would not hold counts on every floor, before a tip slips.

    Args:
        tip_shear_n: S, the contact forces' parts along the ground [N].
        tip_force_n: F, their magnitudes [N].
        friction: μ [1].

    Returns:
        Magnitude [N], ≥ 0; 0 for forces within the cone.

    Source:
        Ours, after Coulomb's friction cone.

    Examples:
        Of 1 N that leans by 30° a floor of 0.25 holds 0.24 N along it:

        >>> print(f"{shear_excess(jnp.array([0.5]), jnp.array([1.0])):.2f}")
        0.26
    """
    held_n = tip_force_n * friction / jnp.sqrt(1.0 + jnp.square(friction))
    return jnp.sum(jnp.maximum(tip_shear_n - held_n, 0.0))
