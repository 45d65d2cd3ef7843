"""The reward of one world: its table's weights and their use in one step."""

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from envs.base import State
from envs.config.settings.rows import check_rows
from envs.memory import PerWorldState
from rewards import (
    Constant,
    GeometricDecay,
    RewardTable,
    Schedule,
    StepSwitch,
    evaluate,
    table_weights,
    weights_at,
)


def scheduled_weights(
    table: RewardTable,
    values: Mapping[str, float],
    curriculum_scale: float,
    schedule_scale: Mapping[str, float],
) -> dict[str, Schedule]:
    """Weights of a table with other values and another pace.

    Args:
        table: reward table.
        values: row name -> weight in the place of the one that a schedule starts, or
            after a switch ends, with.
        curriculum_scale: factor on the steps at which schedules change.
        schedule_scale: row name -> further factor on those of its schedule.

    Raises:
        InputError: there is no row of that name.
    """
    check_rows(table, values, schedule_scale)
    weights = table_weights(table, None)
    for name, value in values.items():
        weights = weights | {name: _with_value(weights[name], value)}
    scale, own = curriculum_scale, schedule_scale
    return {k: _with_time_scale(w, scale * own.get(k, 1.0)) for k, w in weights.items()}


def with_weights(state: State, weights: Mapping[str, Schedule]) -> State:
    """Returns `state` with other reward weights, which episodes to come keep.

    Args:
        state: of one world, or of many.
        weights: schedules as from `scheduled_weights`; for many worlds with a leading
            axis of their number.
    """
    world = state.memory.world.replace(weights=dict(weights))
    return state.replace(memory=state.memory.replace(world=world))


def score(
    table: RewardTable,
    world: PerWorldState,
    named: Mapping[str, Any],
    dt_s: float,
    valid: Bool[Array, ""],
) -> tuple[PerWorldState, Float[Array, ""], dict[str, Float[Array, ""]]]:
    """Evaluates the table with the weights of this step, r = Σ_k w_k(n) m_k Δt.

    The step is counted, n ← n + 1, also where it is not valid.

    Args:
        table: reward table.
        world: the world's weights and the step that their schedules have come to.
        named: signals and magnitudes by name.
        dt_s: control interval [s].
        valid: whether the step counts; an invalid one pays nothing.

    Returns:
        The world after the step, the reward and its terms [1].

    Source:
        Ours; see `rewards.evaluate`.
    """
    weights = weights_at(world.weights, world.total_steps)
    total, terms = evaluate(table, named, weights, dt_s)
    world = world.replace(total_steps=world.total_steps + 1)
    paid = jax.tree.map(lambda x: jnp.where(valid, x, 0.0), (total, terms))
    return world, *paid


def _with_value(schedule: Schedule, value: float) -> Schedule:
    """Replaces the weight that a schedule starts, or after a switch ends, with."""
    field_name = {Constant: "value", StepSwitch: "after", GeometricDecay: "start"}
    return schedule.replace(
        **{field_name[type(schedule)]: jnp.asarray(value, jnp.float32)}
    )


def _with_time_scale(schedule: Schedule, scale: float) -> Schedule:
    """Stretches the steps at which a schedule changes."""
    steps = ("at_steps", "hold_steps", "decay_steps")
    stretched = {k: v * scale for k, v in vars(schedule).items() if k in steps}
    return schedule.replace(**stretched)
