"""Direction objective: an airborne tip should not swing against the command."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from rewards.gates import (
    DEAD_SPEED_MPS,
    FORCE_THRESHOLD_N,
    in_contact,
    is_commanded,
)
from rewards.shaping import Scalar, safe_norm


def swing_against_command(
    tip_vel_v: Float[Array, "tips 3"],
    tip_force_n: Float[Array, " tips"],
    command: Float[Array, "3"],
    force_threshold_n: Scalar = FORCE_THRESHOLD_N,
    dead_speed_mps: Scalar = DEAD_SPEED_MPS,
) -> Float[Array, ""]:
    """Speed of airborne tips opposite to the command, Σ_j h_j max(0, −u_j · v̂_cmd).

    h_j = (F_j < F_th) ∧ (|v_cmd| ≥ v_dead). The contact memory of the lift gate takes
    no part: the paper asks for these two conditions only. That the term is linear in
    the speed and a sum over tips is our reading of "its planar component opposite to
    the command direction".

    Args:
        tip_vel_v: tip velocities relative to the rotating base in V [m/s].
        tip_force_n: contact force magnitudes [N].
        command: v_x, v_y [m/s] and yaw rate [rad/s] in V; the yaw rate is not read.
        force_threshold_n: F_th [N].
        dead_speed_mps: v_dead [m/s].

    Returns:
        Magnitude [m/s], ≥ 0; 0 when no airborne tip moves backward.

    Source:
        Paper, "Auxiliary direction objective".

    Examples:
        Two tips in the air under a command straight ahead: one swings back, one ahead.

        >>> tips_vel_v = jnp.array([[-0.1, 0.0, 0.0], [0.1, 0.0, 0.0]])
        >>> ahead = jnp.array([0.16, 0.0, 0.0])
        >>> print(f"{swing_against_command(tips_vel_v, jnp.zeros(2), ahead):.2f}")
        0.10
    """
    planar = command[:2]
    speed_mps = safe_norm(planar)
    heading = planar / jnp.where(speed_mps == 0.0, 1.0, speed_mps)
    backward_mps = jnp.maximum(-tip_vel_v[:, :2] @ heading, 0.0)
    airborne = ~in_contact(tip_force_n, force_threshold_n)
    return jnp.sum(
        jnp.where(airborne & is_commanded(planar, dead_speed_mps), backward_mps, 0.0)
    )
