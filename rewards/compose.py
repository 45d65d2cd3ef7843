"""Reward tables: rows of (name, kernel, weight, signals), evaluated in one place.

reward = Σ_rows weight × magnitude × Δt. Kernels give magnitudes ≥ 0, the sign is in the
weight, and the control interval multiplies here and nowhere else.

A term with memory (lift, air time, footprint targets) is stepped by the caller, who
carries its memory; what the step returns goes into the signals under a name such as
`lift_magnitude`, and the row passes it on with the kernel `precomputed`.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rewards.schedules import Constant, Schedule, Steps
from rewards.shaping import Scalar


@dataclass(frozen=True)
class RewardTerm:
    """One row of a reward table.

    Attributes:
        name: unique in its table; the key of the weight and of the logged term.
        kernel: pure function of explicit arrays of one environment, giving a scalar.
        weight: default weight, with the sign of the term.
        signals: names of the signals bound to the kernel's arguments, in their order.
    """

    name: str
    kernel: Callable[..., Array]
    weight: Scalar | Schedule
    signals: tuple[str, ...]


RewardTable = tuple[RewardTerm, ...]


def precomputed(magnitude: Float[Array, ""]) -> Float[Array, ""]:
    """Kernel of a term whose magnitude a stateful step has already computed, m = m.

    Args:
        magnitude: m, in the unit of that step ([m/s], [s], [1]).

    Returns:
        The same number.

    Source:
        Ours.
    """
    return magnitude


def table_weights(
    table: RewardTable, overrides: Mapping[str, Scalar | Schedule] | None = None
) -> dict[str, Schedule]:
    """Weights of a table as a pytree of arrays, ready to be a traced argument.

    Args:
        table: reward table.
        overrides: weights that replace those of the table. A number in the place of a
            constant, or a schedule in the place of one of its kind, leaves the tree's
            structure and with it the compiled program as it is.

    Returns:
        One schedule per row, its leaves arrays of the default float type.

    Raises:
        ValueError: a name in `overrides` is not a row, or rows share a name.

    Examples:
        >>> still = RewardTerm("still", lambda v: jnp.sum(v**2), -2.0, ("vel_v",))
        >>> heavier = table_weights((still,), {"still": -5.0})
        >>> print(heavier["still"](0))
        -5.0
        >>> table_weights((still,), {"stil": -5.0})
        Traceback (most recent call last):
        ValueError: weights of unknown reward terms: stil; valid: still
    """
    chosen = {row.name: row.weight for row in table} | dict(overrides or {})
    _check_rows(table, chosen)
    schedules = {name: _as_schedule(weight) for name, weight in chosen.items()}
    return jax.tree.map(lambda x: jnp.asarray(x, jnp.result_type(float)), schedules)


def weights_at(
    weights: Mapping[str, Schedule], steps: Steps
) -> dict[str, Float[Array, ""]]:
    """Values of all weights after n control steps of this environment, w ← w(n).

    Args:
        weights: schedules by row name, as from `table_weights`.
        steps: n, control steps completed since training began, ≥ 0.

    Returns:
        One number per row; its unit is that of 1/(magnitude · s), so that terms
            are [1].

    Source:
        Ours; the schedules are the paper's.
    """
    return {name: schedule(steps) for name, schedule in weights.items()}


def evaluate(
    table: RewardTable,
    signals: Mapping[str, Any] | Any,
    weights: Mapping[str, Scalar],
    dt_s: Scalar,
) -> tuple[Float[Array, ""], dict[str, Float[Array, ""]]]:
    """Reward of one step and its terms, r = Σ_k w_k m_k Δt.

    Args:
        table: rows to evaluate.
        signals: arrays by name, in a mapping or a dataclass. For a dataclass and extras
            together, pass `vars(signals) | {"lift_magnitude": magnitude}`.
        weights: weight of each row by name, as from `weights_at`.
        dt_s: control interval Δt [s].

    Returns:
        The reward and {name: w m Δt}, sorted by name as JAX sorts every dict. The
        reward is the sum of these in that order, to the last bit, also when compiled,
        so it does not depend on the order of the rows.

    Raises:
        ValueError: rows share a name, a row binds a signal that is not there, or the
            names of `weights` are not those of the rows.

    Source:
        Isaac Lab, whose reward manager also multiplies by Δt; the order is ours.

    Examples:
        A table of one row, on one hand that moves at 0.1 m/s:

        >>> table = (RewardTerm("still", lambda v: jnp.sum(v**2), -2.0, ("vel_v",)),)
        >>> weights = weights_at(table_weights(table), steps=0)
        >>> hand = {"vel_v": jnp.array([0.1, 0.0, 0.0])}
        >>> reward, terms = evaluate(table, hand, weights, dt_s=0.02)
        >>> print(f"{reward:.4f}", list(terms))
        -0.0004 ['still']
    """
    _check_rows(table, weights)
    named = signals if isinstance(signals, Mapping) else vars(signals)
    _check_signals(table, named)
    terms = {}
    for row in sorted(table, key=lambda row: row.name):
        magnitude = row.kernel(*(named[name] for name in row.signals))
        terms[row.name] = _rounded(weights[row.name] * magnitude * dt_s)
    return jnp.asarray(sum(terms.values(), start=0.0)), terms


def _rounded(product: Float[Array, ""]) -> Float[Array, ""]:
    """Keeps the compiler from fusing a product into the sum that follows it.

    A fused multiply-add skips the rounding of the product, and the reward would no
    longer be the sum of the logged terms. The selection changes no value, NaN included.
    """
    return jnp.where(jnp.isnan(product), jnp.nan, product)


def _as_schedule(weight: Scalar | Schedule) -> Schedule:
    """Returns numbers as constant schedules."""
    return weight if isinstance(weight, Schedule) else Constant(weight)


def _check_rows(table: RewardTable, weights: Iterable[str]) -> None:
    """Raises unless the rows have unique names and `weights` names exactly them."""
    names = [row.name for row in table]
    _refuse("duplicate reward terms", {n for n in names if names.count(n) > 1}, names)
    _refuse("weights of unknown reward terms", set(weights) - set(names), names)
    _refuse("no weight for reward terms", set(names) - set(weights), weights)


def _check_signals(table: RewardTable, named: Mapping[str, Any]) -> None:
    """Raises unless every signal that a row binds is there."""
    for row in table:
        missing = set(row.signals) - set(named)
        _refuse(f"reward term {row.name!r} binds unknown signals", missing, named)


def _refuse(what: str, wrong: set[str], valid: Iterable[str]) -> None:
    """Raises ValueError with the wrong and the valid names, if any are wrong."""
    if wrong:
        listed = ", ".join(dict.fromkeys(valid)) or "none"
        raise ValueError(f"{what}: {', '.join(sorted(wrong))}; valid: {listed}")
