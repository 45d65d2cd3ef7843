"""Pressing keys: nearness of the fingertip, depth, support, other keys."""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from rewards.gates import FORCE_THRESHOLD_N, in_contact
from rewards.shaping import Scalar, safe_norm

APPROACH_WIDTH_M = 0.01
"""Distance at which the approach penalty has fallen to half [m]; ours."""


def fingertip_distance(
    offset_m: Float[Array, "3"],
    asked: Float[Array, ""],
    width_m: Scalar = APPROACH_WIDTH_M,
) -> Float[Array, ""]:
    """Distance d = ‖e‖ of the fingertip from where it should be, a d/(d + w).

    Its slope is largest where the tip is nearly there, and it never exceeds 1, so that
    a far tip costs no more than a pending request may.

    Args:
        offset_m: e, from the tip to its goal [m].
        asked: a, 1 while the goal counts, else 0.
        width_m: w [m].

    Returns:
        Magnitude in [0, 1).

    Source:
        Paper, keyboard pressing (approach); the shape is ours.
    """
    distance = safe_norm(offset_m)
    return asked * distance / (distance + width_m)


def requested_depth(
    depth_m: Float[Array, " keys"],
    actuation_m: Float[Array, " keys"],
    requested: Float[Array, " keys"],
) -> Float[Array, ""]:
    """How far the requested key is on its way to actuation, Σ r clip(d/d_a, 0, 1).

    Args:
        depth_m: travel d of each key [m].
        actuation_m: actuation depth d_a of each key [m].
        requested: r, 1 at the requested key, zeros without a request.

    Returns:
        Magnitude in [0, 1].

    Source:
        Paper, keyboard pressing (increasing press depth); the shape is ours.

    Examples:
        The second of two keys is asked for, and pressed half of its way:

        >>> depth_m, actuation_m = jnp.array([0.0, 0.001]), jnp.array([0.002, 0.002])
        >>> print(requested_depth(depth_m, actuation_m, jnp.array([0.0, 1.0])))
        0.5
    """
    return jnp.sum(requested * jnp.clip(depth_m / actuation_m, 0.0, 1.0))


def other_depth(
    depth_m: Float[Array, " keys"],
    actuation_m: Float[Array, " keys"],
    requested: Float[Array, " keys"],
) -> Float[Array, ""]:
    """The same of all keys that are not requested, Σ (1 − r) clip(d/d_a, 0, 1).

    Args:
        depth_m: travel d of each key [m].
        actuation_m: actuation depth d_a of each key [m].
        requested: r, 1 at the requested key, zeros without a request.

    Returns:
        Magnitude in [0, keys].

    Source:
        Paper, keyboard pressing (wrong-key presses); that a press on its way counts
        too, and a key that is held after its request, is ours.
    """
    return jnp.sum((1.0 - requested) * jnp.clip(depth_m / actuation_m, 0.0, 1.0))


def support_contact(
    support_force_n: Float[Array, " tips"],
    force_threshold_n: Scalar = FORCE_THRESHOLD_N,
) -> Float[Array, ""]:
    """Share of the supporting fingertips that stand on the ground, Σ_j [F_j ≥ F_th]/n.

    Args:
        support_force_n: contact forces of all tips but the pressing one [N].
        force_threshold_n: F_th [N].

    Returns:
        Magnitude in [0, 1].

    Source:
        Paper, keyboard pressing (support from other fingertips).
    """
    return jnp.mean(in_contact(support_force_n, force_threshold_n).astype(jnp.float32))


def keys_touched(touched: Bool[Array, " keys"]) -> Float[Array, ""]:
    """Number of keys that another part of the hand touches, Σ_k c_k.

    Args:
        touched: c, for each key, whether something but the pressing fingertip touches
            it [1].

    Returns:
        Magnitude, a count in [0, keys].

    Source:
        Paper, keyboard pressing (keycap contact by other hand parts).
    """
    return jnp.sum(touched.astype(jnp.float32))


def support_drift(
    support_pos_w: Float[Array, "tips 2"], support_start_w: Float[Array, "tips 2"]
) -> Float[Array, ""]:
    """Mean distance of the supporting tips from where they first stood, Σ ‖p − s‖/n.

    Args:
        support_pos_w: places p of the supporting tips on the ground [m].
        support_start_w: s, the same at the episode's start [m].

    Returns:
        Magnitude [m], ≥ 0.

    Source:
        Ours: the keyboard is not observed, so presses depend on a stance that stays
        (paper, maintained alignment).
    """
    return jnp.mean(safe_norm(support_pos_w - support_start_w))
