"""How far the coordinates of a fit may be from the truth.

Three things count, as deviations of a coordinate:

    noise         H⁻¹ s², H = JᵀJ + prior
    excitation    H⁻¹ (Σ_b g_b g_bᵀ) H⁻¹, g_b the slope of the error on stretch b
    the unknown   what a servo's own cycle does to figures of its command path; what a
                  grid's size may change by without another target on it; that a spring
                  is told by a resonance whose damping ratio is only assumed, and play
                  by flights between walls that are assumed to give no speed back

The second is larger than the first where stretches of a record contradict each other,
as they do where the model is not quite true or its errors hang together.
"""

import math

import numpy as np
from jaxtyping import Float, Int

from sysid.diagnosis.replay.link import DAMPING
from sysid.diagnosis.replay.residuals import EVERY
from sysid.diagnosis.replay.timing_uncertainty import CYCLE_S
from sysid.diagnosis.replay.track import JointTrack
from sysid.diagnosis.search.candidate import Model
from sysid.diagnosis.search.parameters import Slot
from sysid.diagnosis.search.problem import Problem
from sysid.least_squares import block_sandwich

COMB_SHARE = 1.5e-4
"""Deviation of a grid's size, relative: half the step by which its slope is found,
within which one target more or less falls on another tooth."""

BOUNCE = 0.04
"""Deviation of a play, relative, because of what its walls give back: a restitution of
0.15 makes plays of light joints, whose links fly for long, a tenth too small."""

STRETCH_S = 0.5
"""Length of the stretches of a record that are compared [s]."""


def deviations(problem: Problem, model: Model, samples: int) -> Float[np.ndarray, " n"]:
    """Returns the deviation of every coordinate; zero for those that are fixed.

    Args:
        problem: residuals of a joint.
        model: a fitted model.
        samples: number of residuals that count.
    """
    fit, space = model.fit, problem.space
    prior = np.diag(1.0 / space.deviations(model.effects)[fit.free] ** 2)
    gram = fit.jacobian.T @ fit.jacobian
    scale = max(1.0, model.score / max(samples, 1))
    noise = np.diag(np.linalg.pinv(gram / scale + prior))
    inverse = np.linalg.pinv(gram + prior)
    blocks = _blocks(problem)
    excitation = np.diag(block_sandwich(fit.jacobian, fit.residual, inverse, blocks))
    unknown = [
        _unknown(space.slots[i], float(fit.theta[i]), problem.data) for i in fit.free
    ]
    result = np.zeros(len(space.slots))
    result[fit.free] = np.sqrt(np.maximum(noise, excitation) + np.square(unknown))
    return result


def _blocks(problem: Problem) -> Int[np.ndarray, " r"]:
    """Numbers the stretches; repeats of a stretch belong together."""
    samples = np.arange(len(problem.fold))
    samples = samples % problem.repeat if problem.repeat else samples
    block = (EVERY * problem.data.dt * samples // STRETCH_S).astype(int)
    pieces = problem.fold.shape[1]
    apart = 0 if problem.repeat else (block.max() + 1) * np.arange(pieces)
    return np.concatenate(
        [(block[:, None] + apart * np.ones((1, pieces), int)).ravel()] * 2
    )


def _unknown(slot: Slot, u: float, data: JointTrack) -> float:
    """Returns how far a coordinate u may be off because of what no model has."""
    if slot.comb:
        return COMB_SHARE * abs(u)
    if slot.effect == "compliance":
        return DAMPING * (u if slot.kind == "linear" else 1.0)
    if slot.effect == "backlash":
        return BOUNCE * abs(u)
    return _timing(slot, data)


def _timing(slot: Slot, data: JointTrack) -> float:
    """Returns how far a coordinate may be off because of a servo's cycle.

    A servo meets targets and limits in its own time, and rounds a filter to its cycle:
    the lag of its command path is uncertain by σ = `CYCLE_S`. That is a delay itself, a
    time constant 1 / 2π f, the time A / v of a way at a limited speed, and the time
    τ / S of a rise at a limited slope.
    """
    if slot.name in ("delay_s", "latency_s"):
        return CYCLE_S / slot.scale
    ways = {
        "cutoff_hz": 2.0 * math.pi,
        "speed_rad_s": 2.0 / data.angle_scale,
        "slope_nm_s": 1.0 / data.torque_scale,
    }
    if slot.kind != "reciprocal" or slot.name not in ways:
        return 0.0
    return CYCLE_S * slot.scale * ways[slot.name]
