"""Means gathered on the device: each figure is a sum and a weight, added up freely."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

Totals = dict[str, Float[Array, "*t 2"]]
"""Name -> (sum of the figure, weight); entries of several steps or calls just add."""


def total(values: Array, weight: Array | float = 1.0) -> Float[Array, "2"]:
    """Returns Σ weight·value and Σ weight; values of weight zero may be non-finite."""
    values = jnp.asarray(values, jnp.float32)
    weight = jnp.broadcast_to(jnp.asarray(weight, jnp.float32), values.shape)
    weighted = jnp.where(weight > 0.0, weight * values, 0.0)
    return jnp.stack([jnp.sum(weighted), jnp.sum(weight)])


def count(flags: Array) -> Float[Array, "2"]:
    """Returns the number of set flags, as a figure whose mean is its sum."""
    number = jnp.sum(flags.astype(jnp.float32))
    return jnp.stack([number, jnp.ones(())])


def means(names: list[str], totals: Float[np.ndarray, "k 2"]) -> Mapping[str, float]:
    """Returns sum / weight of each figure; a figure without any weight is left out."""
    rows = zip(names, totals.tolist(), strict=True)
    return {name: value / weight for name, (value, weight) in rows if weight > 0.0}
