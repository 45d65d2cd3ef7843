"""Which candidates have effects that are not at their identity."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Array, Bool, Float

Params = Mapping[str, Mapping[str, Float[Array | np.ndarray, " c"]]]
"""Values of parameters of candidates c, by effect and name."""


def are_acting(
    params: Params, sizes: Sequence[tuple[str, str]], count: int
) -> Bool[np.ndarray, " c"]:
    """Returns whether any of some effects acts in a candidate.

    Args:
        params: values of the parameters by effect; effects may be missing.
        sizes: effects, each with a parameter that is zero where it does nothing.
        count: number of candidates.
    """
    own = [np.asarray(params[e][name]) for e, name in sizes if e in params]
    return np.any([np.zeros(count), *own], axis=0)
