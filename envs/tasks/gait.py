"""What tasks that walk share: the memories of the gait's rewards, and when it fell."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from envs.memory import Memory
from envs.signals import Signals
from envs.task import HandTask
from envs.tasks.upright import fallen
from rewards import (
    AirTimeMemory,
    AirTimeParams,
    LiftMemory,
    LiftParams,
    MeanErrorMemory,
    air_time_step,
    footprint_step,
    init_air_time_memory,
    init_footprint_memory,
    init_lift_memory,
    init_mean_error_memory,
    lift_step,
    mean_error_step,
)

FOOTPRINT = "footprint_target_v"
"""Signal for which a world keeps its footprint."""


@dataclass(frozen=True)
class Stepped:
    """A memory of an episode, which is stepped to give one signal of the rewards.

    Attributes:
        signal: that rows bind; a table that does not bind it carries no memory.
        field: of `envs.memory.Memory`.
        begin: makes the memory of so many fingertips at an episode's start.
        step: (memory, signals, control interval) -> (memory, signal).
        with_command: whether a new command begins it anew.
    """

    signal: str
    field: str
    begin: Callable[[int], Any]
    step: Callable[[Any, Signals, float], tuple[Any, Array]]
    with_command: bool


class Walking(HandTask):
    """A task whose reward has rows of the gait.

    What it carries is what its table binds. `begin_episode` gives `begin_gait`. The
    settings are `UprightSettings`.

    Attributes:
        tips: fingertips of the hand.
    """

    tips: int = 5

    def binds(self, signal: str) -> bool:
        """Whether a row of the table binds this signal."""
        return any(signal in row.signals for row in self.table)

    def begin_world(self) -> dict[str, Any]:
        """No footprint yet: it is captured in the first step and then kept (paper)."""
        if not self.binds(FOOTPRINT):
            return {}
        return {"footprint": init_footprint_memory(self.tips)}

    def begin_gait(self) -> dict[str, Any]:
        """Fresh memories of the rewards, by field of `Memory`."""
        return {kept.field: kept.begin(self.tips) for kept in self._stepped}

    def begin_with_command(self) -> dict[str, Any]:
        """Those of them that begin anew with a new command."""
        new = [kept for kept in self._stepped if kept.with_command]
        return {kept.field: kept.begin(self.tips) for kept in new}

    def magnitudes(
        self, memory: Memory, signals: Signals, valid: Bool[Array, ""]
    ) -> tuple[Memory, dict[str, Float[Array, "..."]]]:
        """Steps the memories that the table binds, (μ, m) ← f(μ, s).

        Args:
            memory: μ, with those of `begin_world` and `begin_gait`.
            signals: s, of this step.
            valid: whether the step counts; the footprint outlives the episode.

        Returns:
            The memory, and what the rewards bind: `footprint_target_v` [m],
            `lift_magnitude` [m/s], `air_time_magnitude` [s], `mean_error_v` [m/s, m/s,
            rad/s].

        Source:
            Paper, eqs. (1) and (2), and Isaac Lab; see `rewards.footprint_step`,
            `rewards.lift_step`, `rewards.air_time_step`, `rewards.mean_error_step`.
        """
        extras = {}
        if self.binds(FOOTPRINT):
            memory, extras[FOOTPRINT] = _footprint(memory, signals, valid)
        for kept in self._stepped:
            before = getattr(memory, kept.field)
            after, value = kept.step(before, signals, self.config.control_dt_s)
            memory = memory.replace(**{kept.field: after})
            extras[kept.signal] = value
        return memory, extras

    def terminated(self, signals: Signals) -> Bool[Array, ""]:
        """Palm contact or tilt, c_palm ∨ |roll| > r ∨ |pitch| > p.

        Returns:
            One flag [1].

        Source:
            Paper, crawling: r = 35°, p = 30°.
        """
        return fallen(signals, self.config)

    @property
    def _stepped(self) -> list[Stepped]:
        return [kept for kept in _STEPPED if self.binds(kept.signal)]


def _footprint(
    memory: Memory, signals: Signals, valid: Bool[Array, ""]
) -> tuple[Memory, Float[Array, "tips 3"]]:
    """Returns the memory and the targets, captured in the world's first valid step."""
    world = memory.world
    stepped = footprint_step(world.footprint, signals.tip_pos_v)
    footprint = jax.tree.map(
        lambda new, old: jnp.where(valid, new, old), stepped, world.footprint
    )
    return memory.replace(world=world.replace(footprint=footprint)), footprint.target_v


def _lift(
    memory: LiftMemory, signals: Signals, dt_s: float
) -> tuple[LiftMemory, Float[Array, ""]]:
    """The paper's lift objective."""
    return lift_step(
        memory,
        signals.tip_vel_v[:, 2],
        signals.tip_force_n,
        signals.command[:2],
        dt_s,
        LiftParams(),
    )


def _air_time(
    memory: AirTimeMemory, signals: Signals, dt_s: float
) -> tuple[AirTimeMemory, Float[Array, ""]]:
    """Isaac Lab's feet air time, with its thresholds; it ignores new commands."""
    force_n, planar = signals.tip_force_n, signals.command[:2]
    return air_time_step(memory, force_n, planar, dt_s, AirTimeParams())


def _mean_error(
    memory: MeanErrorMemory, signals: Signals, dt_s: float
) -> tuple[MeanErrorMemory, Float[Array, "3"]]:
    """The mean error of the velocity."""
    vel_v, angvel_v = signals.vel_v, signals.angvel_v
    return mean_error_step(memory, vel_v, angvel_v, signals.command, dt_s)


_STEPPED = (
    Stepped("lift_magnitude", "lift", init_lift_memory, _lift, with_command=True),
    Stepped(
        "mean_error_v",
        "mean_error",
        lambda tips: init_mean_error_memory(),
        _mean_error,
        with_command=True,
    ),
    Stepped(
        "air_time_magnitude",
        "air_time",
        init_air_time_memory,
        _air_time,
        with_command=False,
    ),
)
