"""Dry friction gives a little before it slips: when that is a hysteresis, and when not.

A hysteresis whose range drowns in the noise of the angle, or is crossed within the band
of the residuals when the motion reverses, is dry friction as far as readings show; what
it gains is of those moments, where the models of friction differ and no one of them is
true.
"""

import numpy as np
from jaxtyping import Bool, Float

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.replay.band import BAND_STEPS, sample_rows
from sysid.diagnosis.replay.motion import JointTrack

RESOLVED = 4.0
"""Presliding range from which on readings show it [standard deviations of the angle's
noise at a step of the grid]."""

DRY_SHARE = 0.1
"""Share of a gain by which a hysteresis that is dry friction must be ahead of it."""


def is_dry(problem: Problem, model: Model) -> bool:
    """Whether the effect added last is a hysteresis that is dry friction.

        d ≤ max(4 σ_q, d_turn),   with `turning_travel` d_turn

    Args:
        problem: residuals of a joint, with the noise σ_q of its angle at a step of the
            grid [rad]; where several readings fall into a step, that of their mean.
        model: a fitted model.

    Source:
        Ours; the limit d → 0 of Dahl's model is Coulomb friction (P. Dahl, Solid
        Friction Damping of Mechanical Vibrations, AIAA Journal 14(12), 1976).
    """
    if model.effects[-1:] != ("hysteresis",):
        return False
    space = problem.space
    ranges = [
        float(space.slots[i].value(model.fit.theta[i]))
        for i in space.of("hysteresis")
        if not space.slots[i].is_size
    ]
    resolved = RESOLVED * problem.data.noise[0]
    return max(ranges) <= max(resolved, turning_travel(problem.data))


def turning_travel(data: JointTrack) -> float:
    """How far a joint moves beside a turn while the band of the residuals lasts.

        d_turn = median |q̈| (B h)² / 2   over the turns, B = `BAND_STEPS`

    Args:
        data: the joint's track, with its speed [rad/s] and acceleration q̈ [rad/s²] at
            steps of length h [s].

    Returns:
        d_turn [rad]; 0 where the motion never turns.

    Source:
        Ours; uniform acceleration from rest.
    """
    vel, acc = (np.asarray(x, float) for x in (data.track.vel, data.track.acc))
    turns = _turns(vel, data.valid)
    if not turns.any():
        return 0.0
    size = float(np.median(np.abs(acc[turns])))
    return 0.5 * size * (BAND_STEPS * data.dt) ** 2


def _turns(
    vel: Float[np.ndarray, "t p"], valid: Bool[np.ndarray, "m p"]
) -> Bool[np.ndarray, "t p"]:
    """Steps before which the sign of the speed changes, where samples count."""
    near = np.searchsorted(sample_rows(len(vel)), np.arange(len(vel)))
    counts = valid[np.minimum(near, len(valid) - 1)]
    counts[1:] &= vel[1:] * vel[:-1] < 0.0
    counts[0] = False
    return counts


def repeats_friction(problem: Problem, model: Model) -> bool:
    """Whether it adds a hysteresis that is dry friction to dry friction itself.

    Args:
        problem: residuals of a joint.
        model: a fitted model.
    """
    return "coulomb_friction" in model.effects and is_dry(problem, model)
