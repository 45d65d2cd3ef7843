"""The low-pass band of the residuals, and the steps at which they are sampled."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from sysid.diagnosis.measured.resampling import SMOOTH_STEPS

BAND_STEPS = 2.2
"""Width of the Gaussian through which both residuals pass [steps of the grid]."""

EVERY = 4
"""Steps of the grid between two samples of a residual."""

_HALF = 8
TAPS = np.exp(-0.5 * (np.arange(-_HALF, _HALF + 1) / BAND_STEPS) ** 2)
TAPS = TAPS / TAPS.sum()

FINE_TAPS = np.exp(-0.5 * (np.arange(-4, 5) / SMOOTH_STEPS) ** 2)
FINE_TAPS = FINE_TAPS / FINE_TAPS.sum()


def smooth(x: Float[Array, "t p c"]) -> Float[Array, "t p c"]:
    """Smooths a torque as the measured channels were: y_t = Σ_k w_k x_{t+k}.

    The target is not smoothed before the chain: limits would act on rounded corners.

    Args:
        x: torques at the steps of the grid [N·m]; its ends are repeated.

    Returns:
        Smoothed torques [N·m]; w is a Gaussian of width `SMOOTH_STEPS`, cut at 4 steps.

    Source:
        Ours: the model's torque and the measured one must pass the same filter.
    """
    reach = len(FINE_TAPS) // 2
    wide = jnp.pad(x, [(reach, reach), (0, 0), (0, 0)], "edge")
    parts = [w * wide[k : k + len(x)] for k, w in enumerate(FINE_TAPS.tolist())]
    return jnp.sum(jnp.stack(parts), 0)


def sharpened(x: Float[Array, "t p"]) -> Float[Array, "t p"]:
    """Sharpens what is smoothed and then read on straight lines between rows.

    A Gaussian of σ steps and the lines keep e^{−σ²ω²/2} d / ω² of a frequency ω, with
    d = 2 − 2 cos ω the second difference's; the inverse is 1 + (σ²/2 + 1/12) d + … d².

    Args:
        x: values at the steps of the grid [any].

    Returns:
        Values whose straight lines, smoothed, are `x` up to the sixth order of ω.

    Source:
        Ours.
    """
    half = 0.5 * SMOOTH_STEPS**2
    first, second = half + 1 / 12, half**2 / 2 + half / 6 + 1 / 90
    bend = _second_difference(x)
    return x - first * bend + second * _second_difference(bend)


def _second_difference(x: Float[Array, "t p"]) -> Float[Array, "t p"]:
    padded = jnp.concatenate([x[:1], x, x[-1:]])
    return padded[2:] - 2.0 * x + padded[:-2]


def band(x: Float[Array, "t p c"]) -> Float[Array, "m p c"]:
    """Gaussian mean at every `EVERY`-th step: y_m = Σ_k w_k x_{E m + k}.

    Args:
        x: residual at the steps of the grid [N·m].

    Returns:
        Samples of the residual [N·m]; see `sample_rows` for their steps.

    Source:
        Ours; filtering of data and model output by the same low-pass: L. Ljung, System
        Identification: Theory for the User, 1999, section 7.2.
    """
    count = (x.shape[0] - len(TAPS)) // EVERY + 1
    last = (count - 1) * EVERY + 1
    parts = [w * x[k : k + last : EVERY] for k, w in enumerate(TAPS.tolist())]
    return jnp.sum(jnp.stack(parts), 0)


def sample_rows(steps: int) -> Int[np.ndarray, " m"]:
    """Steps of the grid at which the residuals are sampled: t_m = 8 + E m.

    Args:
        steps: length of the grid [steps].

    Returns:
        Steps whose whole band lies within the grid [steps].

    Source:
        Ours: the center of the taps of `band`.
    """
    count = (steps - len(TAPS)) // EVERY + 1
    return _HALF + EVERY * np.arange(count)
