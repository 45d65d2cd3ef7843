"""Gates shared by the fingertip terms: contact and motion command."""

from jaxtyping import Array, Bool, Float

from rewards.shaping import Scalar, safe_norm

FORCE_THRESHOLD_N = 0.15
"""F_th [N]: a tip is in contact at or above it (paper, lift objective)."""

DEAD_SPEED_MPS = 0.02
"""v_dead [m/s]: commands below it do not ask for steps (paper, lift objective)."""


def in_contact(
    tip_force_n: Float[Array, " tips"], force_threshold_n: Scalar
) -> Bool[Array, " tips"]:
    """Contact of each tip, c = [F ≥ F_th]; a tip is airborne exactly when c = 0.

    Args:
        tip_force_n: magnitude of the ground contact force [N].
        force_threshold_n: F_th [N].

    Returns:
        One flag per tip.

    Source:
        Paper, "Auxiliary lift objective".
    """
    return tip_force_n >= force_threshold_n


def is_commanded(
    command_planar: Float[Array, "2"], dead_speed_mps: Scalar
) -> Bool[Array, ""]:
    """Whether the command asks for planar motion, c = [‖v_cmd‖ ≥ v_dead].

    Args:
        command_planar: commanded planar velocity [m/s]; its direction does not matter.
        dead_speed_mps: v_dead [m/s].

    Returns:
        One flag.

    Source:
        Paper, "Auxiliary lift objective".
    """
    return safe_norm(command_planar) >= dead_speed_mps
