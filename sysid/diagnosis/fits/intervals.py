"""Standard errors of the coordinates of a fit.

Three variances of a coordinate count, the larger of the first two and the third:

    noise         H⁻¹ s², H = JᵀJ + prior
    sandwich      H⁻¹ (Σ_b g_b g_bᵀ) H⁻¹, g_b the gradient of the error on block b
    unmodelled    what a servo's own cycle does to parameters of its command path; what
                  a grid's size may change by without another target on it; that a
                  spring is identified by a resonance whose damping ratio is only
                  assumed, and play by flights between walls of assumed restitution 0;
                  that a load is what a body weighs beyond a nominal mass, which has a
                  tolerance of its own beside that of all masses together

The second is larger than the first where blocks of a record contradict each other, as
they do where the model is not exact or its errors are correlated.
"""

import math

import numpy as np
from jaxtyping import Float, Int

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.fits.parameters import Slot
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.replay.band import EVERY
from sysid.diagnosis.replay.link import DAMPING
from sysid.diagnosis.replay.motion import JointTrack
from sysid.diagnosis.replay.timing_uncertainty import CYCLE_S
from sysid.least_squares import block_sandwich

GRID_SHARE = 1.5e-4
"""Relative standard error of a grid's size: half the step by which its slope is found,
within which one target more or less is rounded to another value."""

BOUNCE = 0.04
"""Relative standard error of a play because of its walls: a restitution of 0.15
makes plays of light joints, whose links fly for long, a tenth too small."""

BLOCK_S = 0.5
"""Length of the blocks of a record that are compared [s]."""

SPEEDS = ("speed_rad_s", "up_rad_s", "down_rad_s")
"""Limits of a speed, also by direction."""


def standard_errors(
    problem: Problem, model: Model, samples: int
) -> Float[np.ndarray, " n"]:
    """Standard errors σ_i² = max(noise_ii, sandwich_ii) + unmodelled_i².

    Args:
        problem: residuals of a joint.
        model: a fitted model.
        samples: number of residuals that count.

    Returns:
        σ of every coordinate, in units of its scale [1]; zero for those that are fixed.

    Source:
        Sandwich covariance under a misspecified model: H. White, Maximum likelihood
        estimation of misspecified models, 1982. The third term is ours.
    """
    fit, space = model.fit, problem.space
    prior = np.diag(1.0 / space.prior_sds(model.effects)[fit.free] ** 2)
    gram = fit.jacobian.T @ fit.jacobian
    scale = model.variance(samples)
    noise = np.diag(np.linalg.pinv(gram / scale + prior))
    inverse = np.linalg.pinv(gram + prior)
    blocks = _blocks(problem)
    sandwich = np.diag(block_sandwich(fit.jacobian, fit.residual, inverse, blocks))
    unmodelled = [
        _unmodelled(space.slots[i], float(fit.theta[i]), problem.data) for i in fit.free
    ]
    result = np.zeros(len(space.slots))
    result[fit.free] = np.sqrt(np.maximum(noise, sandwich) + np.square(unmodelled))
    return result


def _blocks(problem: Problem) -> Int[np.ndarray, " r"]:
    """Numbers the blocks of time; repeats of a block belong together."""
    repeat = problem.repeat
    block = (EVERY * problem.data.dt * repeat.root // BLOCK_S).astype(int)
    apart = (block.max() + 1) * repeat.root_piece
    return np.concatenate([(block + apart).ravel()] * 2)


def _unmodelled(slot: Slot, u: float, data: JointTrack) -> float:
    """Standard error of a coordinate u by what no model has."""
    if slot.many_optima:
        return GRID_SHARE * abs(u)
    if slot.effect == "compliance":
        return DAMPING * (u if slot.kind == "linear" else 1.0)
    if slot.effect == "backlash":
        return BOUNCE * abs(u)
    if slot.effect == "payload_mass" and slot.nominal == 0.0:
        return slot.prior_sd
    return timing_error(slot, u, data)


def timing_error(slot: Slot, u: float, data: JointTrack) -> float:
    """Standard error of a coordinate by a servo's cycle, in units of its scale [1].

    A servo meets targets and limits in its own time, and rounds a filter to its cycle:
    the lag of its command path is uncertain by σ = `CYCLE_S`. That is a delay itself, a
    time constant 1 / 2π f, the time A / v of a way at a limited speed, the time
    √(2 A / a) of one at a limited acceleration or v / a until its speed, and the time
    τ / S of a rise at a limited slope.

    Args:
        slot: the coordinate.
        u: where it is [1].
        data: with sizes that occur: A [rad], v [rad/s], τ [N·m].

    Returns:
        0 where a servo's cycle does nothing.

    Source:
        Ours.
    """
    if slot.name in ("delay_s", "latency_s"):
        return CYCLE_S / slot.scale
    if slot.kind != "reciprocal":
        return 0.0
    if slot.name == "acceleration_rad_s2":
        whole = math.sqrt(4.0 * slot.scale * abs(u) / data.angle_scale)
        return CYCLE_S * max(slot.scale / data.speed_scale, whole)
    ways = {
        "cutoff_hz": 2.0 * math.pi,
        **dict.fromkeys(SPEEDS, 2.0 / data.angle_scale),
        "slope_nm_s": 1.0 / data.torque_scale,
    }
    return CYCLE_S * slot.scale * ways.get(slot.name, 0.0)
