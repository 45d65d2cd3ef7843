"""Candidates that were evaluated before are not evaluated again.

Fits that go on from where others ended, or begin at one place with several sets of
effects, ask for the same again: a quarter of all. A result counts for one program only,
since two of them agree to the last digit but one, and a search may turn on that; those
of `equations.LEFT_OUT` share a memory, as they do the same in the same order.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int

MOST_BYTES = 2**27
"""Memory of one program beyond which the oldest results are forgotten [bytes]."""

Memory = dict[bytes, np.ndarray]
"""Results by the bytes of their coordinates, the oldest first."""


def remembered(
    memory: Memory,
    thetas: Float[np.ndarray, "c n"],
    evaluate: Callable[[Int[np.ndarray, " k"]], Float[np.ndarray, "k ..."]],
) -> Float[np.ndarray, "c ..."]:
    """Results f(θ) of candidates, from memory where they are known.

    Args:
        memory: results so far, of the same function f; new ones are added.
        thetas: coordinates of candidates [1].
        evaluate: f of the candidates with these numbers, of single precision.

    Returns:
        One result for each candidate, in single precision.

    Source:
        Ours.
    """
    keys = [theta.tobytes() for theta in thetas]
    new = {k: i for i, k in reversed(list(enumerate(keys))) if k not in memory}
    if new:
        order = sorted(new.values())
        found = evaluate(np.array(order)).astype(np.float32, copy=False)
        memory |= {keys[i]: row for i, row in zip(order, found, strict=True)}
    result = np.stack([memory[k] for k in keys])
    spare = len(memory) - MOST_BYTES // max(memory[keys[0]].nbytes, 1)
    for key in list(memory)[: max(spare, 0)]:
        del memory[key]
    return result
