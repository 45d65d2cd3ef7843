"""Sine and cosine in arithmetic that a compiler turns into vector instructions.

On the CPU XLA calls the C library once for every number's sine, and again wherever the
same sine is used: of a joint's equations along a record that is nearly all the time.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

_QUARTER = (1.5703125, 4.837512969970703e-4, 7.549789948768648e-8)
"""π / 2 in three parts; multiples below 2¹³ of the first two are exact."""

_SINE = (-1.9515295891e-4, 8.3321608736e-3, -1.6666654611e-1)
_COSINE = (2.443315711809948e-5, -1.388731625493765e-3, 4.166664568298827e-2)


def sine_cosine(x: Float[Array, "*b"]) -> tuple[Float[Array, "*b"], Float[Array, "*b"]]:
    """Computes sin x and cos x of single precision, to about its last digit.

        x = k π/2 + r,  |r| ≤ π/4,   sin r = r + r³ S(r²),   cos r = 1 − r²/2 + r⁴ C(r²)

    Args:
        x: angles up to 8,000 rad; beyond, what comes out is a number in [−1, 1] [rad].

    Returns:
        Sine and cosine [1]; NaN of what is not finite.

    Source:
        S. L. Moshier, Cephes Mathematical Library, single/sinf.c, 1992 (reduction of W.
        J. Cody and W. Waite, and both polynomials).
    """
    if x.dtype != jnp.float32:
        return jnp.sin(x), jnp.cos(x)
    quarters = jnp.round(x * (2.0 / jnp.pi))
    r = x
    for part in _QUARTER:
        r = r - quarters * part
    r = jnp.clip(r, -0.8, 0.8)
    square = r * r
    sine = r + r * square * _polynomial(_SINE, square)
    cosine = 1.0 - 0.5 * square + square * square * _polynomial(_COSINE, square)
    turns = 0.25 * quarters
    place = 4.0 * (turns - jnp.floor(turns))
    swapped = (place == 1.0) | (place == 3.0)
    first = jnp.where(swapped, cosine, sine)
    second = jnp.where(swapped, sine, cosine)
    back = (place == 1.0) | (place == 2.0)
    return jnp.where(place >= 2.0, -first, first), jnp.where(back, -second, second)


def _polynomial(factors: tuple[float, ...], x: Float[Array, "*b"]):
    """Evaluates a polynomial, its highest power first."""
    value = jnp.full_like(x, factors[0])
    for factor in factors[1:]:
        value = value * x + factor
    return value
