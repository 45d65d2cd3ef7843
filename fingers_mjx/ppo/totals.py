"""Means gathered on the device: each metric is a sum and a weight, added up freely."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Shaped

Totals = dict[str, Float[Array, "*t 2"]]
"""Name -> (sum of the metric, weight); entries of several steps or calls just add."""


def total(
    values: Shaped[Array, "*b"], weight: Shaped[Array, "*w"] | float = 1.0
) -> Float[Array, "2"]:
    """(Σ wᵢ xᵢ, Σ wᵢ): numerator and denominator of a weighted mean.

    Args:
        values: x in its own unit [1 for counts]; may be non-finite where w = 0.
        weight: w ≥ 0 [1], broadcast to the shape of `values`.

    Source:
        Ours: pairs of several steps, calls and devices add up to the mean of all.
    """
    values = jnp.asarray(values, jnp.float32)
    weight = jnp.broadcast_to(jnp.asarray(weight, jnp.float32), values.shape)
    weighted = jnp.where(weight > 0.0, weight * values, 0.0)
    return jnp.stack([jnp.sum(weighted), jnp.sum(weight)])


def count(flags: Bool[Array, "*b"]) -> Float[Array, "2"]:
    """(Σ bᵢ, 1): the number of set flags [1], a metric whose mean is its sum.

    Source:
        Ours, see `total`.
    """
    number = jnp.sum(flags.astype(jnp.float32))
    return jnp.stack([number, jnp.ones(())])


def means(names: list[str], totals: Float[np.ndarray, "k 2"]) -> Mapping[str, float]:
    """Σ w x / Σ w of each metric by name, in its unit [1 for counts].

    A metric without any weight has no mean and is omitted.

    Source:
        Ours, see `total`.
    """
    rows = zip(names, totals.tolist(), strict=True)
    return {name: value / weight for name, (value, weight) in rows if weight > 0.0}
