"""Health of the learner: what was set aside or skipped, and what went wrong first."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Int


@flax.struct.dataclass
class Health:
    """Record of what was not finite.

    Attributes:
        streak: consecutive updates skipped, up to now.
        worst_streak: longest such streak of the run.
        skipped: all updates skipped.
        first_term: index into `term_names` of the first fault of the latest streak;
            -1 if there was none.
        first_iteration: iteration in which the latest streak began; -1 likewise.
        fault: index into `rollout.FAULTS` of the latest step set aside.
        fault_world: world of that step; -1 if there was none.
        fault_iteration: iteration of that step; -1 likewise.
    """

    streak: Int[Array, ""]
    worst_streak: Int[Array, ""]
    skipped: Int[Array, ""]
    first_term: Int[Array, ""]
    first_iteration: Int[Array, ""]
    fault: Int[Array, ""]
    fault_world: Int[Array, ""]
    fault_iteration: Int[Array, ""]


def healthy() -> Health:
    """Returns the record of a run in which nothing has been skipped."""
    zero, none = jnp.zeros((), jnp.int32), jnp.full((), -1, jnp.int32)
    return Health(zero, zero, zero, none, none, zero, none, none)


def term_names(terms: Mapping[str, Any]) -> list[str]:
    """Names everything that is watched, as "params/policy/…" or "loss/total".

    Args:
        terms: the groups of values watched, in the order of suspicion.
    """
    names = []
    for group, tree in terms.items():
        for path, _ in jax.tree_util.tree_leaves_with_path(tree):
            leaf = jax.tree_util.keystr(path, simple=True, separator="/")
            names.append(f"{group}/{leaf}" if leaf else group)
    return names


def finite_terms(terms: Mapping[str, Any]) -> Bool[Array, " k"]:
    """okᵢ = ∧ isfinite(xᵢ) [1]: whether each of `term_names(terms)` is finite.

    Source:
        Ours: an update is skipped if any of them is not.
    """
    leaves = [leaf for tree in terms.values() for leaf in jax.tree.leaves(tree)]
    return jnp.stack([jnp.all(jnp.isfinite(leaf)) for leaf in leaves])


def record(
    health: Health, finite: Bool[Array, " k"], iteration: Int[Array, ""]
) -> Health:
    """Returns `health` after an update whose terms were `finite` or not.

    With bad = ¬∧ finiteᵢ: streak ← (streak + 1)·bad, worst ← max(worst, streak),
    skipped ← skipped + bad [counts of updates, 1]. Where a streak begins, its first
    term that is not finite and its iteration are kept.

    Source:
        Ours.
    """
    bad = ~jnp.all(finite)
    begins = bad & (health.streak == 0)
    streak = jnp.where(bad, health.streak + 1, 0)
    first = jnp.argmin(finite).astype(jnp.int32)
    return dataclasses.replace(
        health,
        streak=streak,
        worst_streak=jnp.maximum(health.worst_streak, streak),
        skipped=health.skipped + bad,
        first_term=jnp.where(begins, first, health.first_term),
        first_iteration=jnp.where(begins, iteration, health.first_iteration),
    )


def note_faults(
    health: Health, faults: Int[Array, "t b"], iteration: Int[Array, ""]
) -> Health:
    """Returns `health` after a rollout with these `faults`; 0 is a sound step.

    world = min {i : max_t faults[t, i] > 0} [1], the lowest of several worlds; its
    largest fault and the iteration are kept with it.

    Source:
        Ours.
    """
    worst = jnp.max(faults, axis=0)
    world = jnp.argmax(worst > 0).astype(jnp.int32)
    found = worst[world] > 0
    return dataclasses.replace(
        health,
        fault=jnp.where(found, worst[world], health.fault).astype(jnp.int32),
        fault_world=jnp.where(found, world, health.fault_world),
        fault_iteration=jnp.where(found, iteration, health.fault_iteration),
    )
