"""What a candidate pays for calling the noise of the readings loud.

Residuals are divided by the noise that a candidate would have. A spring between motor
and link turns encoder noise into torque at its resonance: the density of n readings
falls by Aⁿ where their noise is A times as large, and that explains nothing.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from sysid.diagnosis.replay.link import MOST_ROTOR, spring_noise
from sysid.diagnosis.replay.residuals import EVERY
from sysid.diagnosis.search.problem import Problem


def loudness(problem: Problem, theta: Float[np.ndarray, " n"], error: float) -> float:
    """Returns n log A [nat] of the mechanics' residual.

    Args:
        problem: with its noise.
        theta: coordinates of the candidate.
        error: mean squared weighted residual; below one where samples tell the same,
            of which one counts.
    """
    where = problem.space.of("compliance")
    if not where or theta[where[0]] <= 0.0:
        return 0.0
    slots, track = problem.space.slots, problem.data.track
    soft, rotor = (float(slots[i].value(np.array(theta[i]))) for i in where)
    whole = float(np.mean(np.asarray(track.inertia)))
    rotor = min(rotor, MOST_ROTOR * whole)
    heard = (track.noise[1, 0], track.noise[1, 3], EVERY * problem.data.dt)
    inner, spring, rest = (jnp.full((1, 1), x) for x in (rotor, soft, whole - rotor))
    loud = float(spring_noise(rest, inner, spring, *heard)[0, 0])
    count = float(problem.counts().reshape(2, -1)[1].sum())
    return count * min(1.0, error) * float(np.log(loud))
