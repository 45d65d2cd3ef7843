"""How hard the joints press: what the robot's supervisor watches."""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from envs.plant import Plant
from envs.signals import Signals

STALL_SHARE, STALL_S = 0.9, 1.0
"""Share of the effort limit, and how long: row S5 of the supervisor's table."""
LAG_RAD, LAG_S = 0.5, 0.5
"""Distance from the target, and how long: row S8b."""


def load_signals(
    plant: Plant, carried: Mapping[str, Any], signals: Signals, scale_rad: float
) -> dict[str, Float[Array, " joints"]]:
    """How near its limit each joint is, |τ|/τ_max, and behind its target, |θ − q|.

    Args:
        plant: the hand.
        carried: fields of the `Memory` before the step.
        signals: of the step.
        scale_rad: α, the increment of a target at full action [rad].

    Returns:
        `effort_share` [1] and `joint_lag_rad` [rad].

    Source:
        Ours.
    """
    limit_nm = jnp.asarray(plant.mj_model.actuator_forcerange[:, 1], jnp.float32)
    limit_nm = limit_nm * carried["world"].variation.effort_scale
    target_rad = plant.next_target(carried["target"], signals.action, scale_rad)
    return {
        "effort_share": jnp.abs(signals.torque_nm) / limit_nm,
        "joint_lag_rad": jnp.abs(target_rad - signals.joint_pos),
    }


def stopped(
    effort_share: Float[Array, "T joints"],
    joint_lag_rad: Float[Array, "T joints"],
    counts: Bool[Array, " T"],
    dt_s: float,
) -> Float[Array, ""]:
    """Whether the supervisor would have stopped the hand, ∃ j: a condition that lasts.

    Above 0.9 of the effort limit for 1 s, or more than 0.5 rad from the target for
    0.5 s, of one joint without a break.

    Args:
        effort_share: of each step and joint [1].
        joint_lag_rad: likewise [rad].
        counts: steps before the end of the episode.
        dt_s: control interval Δt [s].

    Returns:
        0 or 1 [1].

    Source:
        Ours: rows S5 (stall) and S8b of the supervisor, at the control rate.
    """
    stall = _lasts((effort_share > STALL_SHARE) & counts[:, None], STALL_S / dt_s)
    lag = _lasts((joint_lag_rad > LAG_RAD) & counts[:, None], LAG_S / dt_s)
    return (stall | lag).astype(jnp.float32)


def _lasts(holds: Bool[Array, "T joints"], steps: float) -> Bool[Array, ""]:
    """Whether a condition holds for more than so many steps on end in some column."""
    number = round(steps) + 1
    total = jnp.cumsum(holds, axis=0)
    before = jnp.concatenate([jnp.zeros((number, holds.shape[1]), total.dtype), total])
    return jnp.any(total - before[: len(total)] >= number)
