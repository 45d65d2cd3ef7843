"""Members of a population: their parts of one batch of worlds, and a step for each.

Worlds of S members lie one after the other in a flat batch of S·W, since physics does
not care whose they are. Learners are stacked: each leaf has the members first.
"""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, PRNGKeyArray


def stacked(trees: Sequence[Any]) -> Any:
    """Returns one tree of `trees`, which share their structure, members first."""
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *trees)


def member_of(tree: Any, index: int) -> Any:
    """Returns the part of one member of a stacked tree."""
    return jax.tree.map(lambda leaf: leaf[index], tree)


def parts(tree: Any, members: int) -> Any:
    """Returns leaves [S·W, …] of a flat batch as [S, W, …]."""
    return jax.tree.map(lambda x: x.reshape(members, -1, *x.shape[1:]), tree)


def flat(tree: Any) -> Any:
    """Returns leaves [S, W, …] as those of a flat batch, [S·W, …]."""
    return jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), tree)


def split_each(keys: PRNGKeyArray, number: int) -> PRNGKeyArray:
    """Returns `number` keys of each member's key, [number, S]."""
    return jax.vmap(lambda key: jax.random.split(key, number), out_axes=1)(keys)


def each(function: Callable[..., Any]) -> Callable[..., Any]:
    """Returns `function` of one member as one of all, which come first in every leaf.

    On accelerators the members are computed side by side. On the CPU they are computed
    one after the other by the same instructions, however many there are: compiled side
    by side, sums could be taken in another order, and a member would no longer be what
    it is alone to the last bit.
    """
    return _in_turn(function) if jax.default_backend() == "cpu" else jax.vmap(function)


def _in_turn(function: Callable[..., Any]) -> Callable[..., Any]:
    """Returns a loop over the members whose body is compiled alike for any number.

    The compiler knows neither how often the loop runs nor which member is next (of a
    single one it would: hence a second that is never used), so that it merges nothing
    of the body with what stands around it.
    """

    def mapped(*trees: Any) -> Any:
        members = len(jax.tree.leaves(trees)[0])
        if members == 1:
            trees = jax.tree.map(lambda leaf: jnp.concatenate([leaf, leaf]), trees)
        one = jax.eval_shape(function, *member_of(trees, 0))
        found = jax.tree.map(
            lambda x: jnp.zeros((max(members, 2), *x.shape), x.dtype), one
        )

        def body(index: Array, found: Any) -> Any:
            own = function(*jax.tree.map(lambda leaf: leaf[index], trees))
            return jax.tree.map(lambda all, x: all.at[index].set(x), found, own)

        times = jax.lax.optimization_barrier(jnp.int32(members))
        found = jax.lax.fori_loop(0, times, body, found)
        return jax.tree.map(lambda leaf: leaf[:members], found)

    return mapped
