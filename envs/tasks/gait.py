"""What tasks that walk share: the memories of the gait's rewards, and when it fell."""

from typing import Protocol

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool

from envs.memory import Memory
from envs.signals import Signals
from rewards import LiftParams, footprint_step, lift_step


class TiltLimits(Protocol):
    """Settings with limits of the tilt."""

    @property
    def max_roll_deg(self) -> float:
        """Largest roll of V [deg]."""
        ...

    @property
    def max_pitch_deg(self) -> float:
        """Largest pitch of V [deg]."""
        ...


def step_gait(
    memory: Memory, signals: Signals, valid: Bool[Array, ""], control_dt_s: float
) -> tuple[Memory, dict[str, Array]]:
    """Steps the footprint and lift memories; returns what their rewards bind.

    Args:
        memory: with `footprint` and `lift`.
        signals: of this step.
        valid: whether the step counts; the footprint outlives the episode.
        control_dt_s: control interval.
    """
    world = memory.world
    footprint = footprint_step(world.footprint, signals.tip_pos_v)
    footprint = jax.tree.map(
        lambda new, old: jnp.where(valid, new, old), footprint, world.footprint
    )
    lift, lift_magnitude = lift_step(
        memory.lift,
        signals.tip_vel_v[:, 2],
        signals.tip_force_n,
        signals.command[:2],
        control_dt_s,
        LiftParams(),
    )
    extras = {
        "footprint_target_v": footprint.target_v,
        "lift_magnitude": lift_magnitude,
    }
    world = world.replace(footprint=footprint)
    return memory.replace(world=world, lift=lift), extras


def fallen(signals: Signals, limits: TiltLimits) -> Bool[Array, ""]:
    """Palm contact, or V tilted beyond the limits (paper)."""
    most = jnp.deg2rad(jnp.array([limits.max_roll_deg, limits.max_pitch_deg]))
    return jnp.any(jnp.abs(signals.tilt_rad) > most) | (signals.palm_contact > 0)
