"""What tasks that walk share: the memories of the gait's rewards, and when it fell."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from envs.memory import Memory
from envs.signals import Signals
from envs.task import HandTask
from envs.tasks.upright import fallen
from rewards import LiftParams, footprint_step, init_footprint_memory, lift_step


class Walking(HandTask):
    """A task whose reward has the rows of the gait.

    `begin_episode` gives the field `lift`. The settings are `UprightSettings`.
    """

    def begin_world(self) -> dict[str, Any]:
        """No footprint yet: it is captured in the first step and then kept (paper)."""
        return {"footprint": init_footprint_memory()}

    def magnitudes(
        self, memory: Memory, signals: Signals, valid: Bool[Array, ""]
    ) -> tuple[Memory, dict[str, Float[Array, "..."]]]:
        """Steps the footprint and lift memories, (μ, m) ← f(μ, s).

        Args:
            memory: μ, with `footprint` and `lift`.
            signals: s, of this step.
            valid: whether the step counts; the footprint outlives the episode.

        Returns:
            The memory, and what the rewards bind: `footprint_target_v` [m] and
            `lift_magnitude` [m/s].

        Source:
            Paper, eqs. (1) and (2); see `rewards.footprint_step`, `rewards.lift_step`.
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
            self.config.control_dt_s,
            LiftParams(),
        )
        extras = {
            "footprint_target_v": footprint.target_v,
            "lift_magnitude": lift_magnitude,
        }
        world = world.replace(footprint=footprint)
        return memory.replace(world=world, lift=lift), extras

    def terminated(self, signals: Signals) -> Bool[Array, ""]:
        """Palm contact or tilt, c_palm ∨ |roll| > r ∨ |pitch| > p.

        Returns:
            One flag [1].

        Source:
            Paper, crawling: r = 35°, p = 30°.
        """
        return fallen(signals, self.config)
