"""Scalar shapes shared by the kernels: safe norm, smoothstep, tracking kernel."""

import jax.numpy as jnp
from jaxtyping import Array, Float, Num

Scalar = float | int | Float[Array, ""]
"""A number, possibly traced."""

Number = float | int | Num[Array, "..."]
"""A field of a parameter pytree: one number, or a stack of them while swept."""


def safe_norm(x: Float[Array, "*n d"]) -> Float[Array, "*n"]:
    """Euclidean norm over the last axis whose gradient at zero is zero.

    |x| = √(Σᵢ xᵢ²). The derivative of √ at 0 is infinite, so 0 is swapped for 1 before
    the root is taken, not after: a `where` around the root alone still gives NaN.

    Args:
        x: vectors of any unit, such as [m/s].

    Returns:
        Norms in the unit of `x`, ≥ 0; NaN where `x` has one.

    Source:
        The "double where" of JAX's FAQ, "Gradients contain NaN where using where".

    Examples:
        >>> import jax
        >>> print(jax.grad(safe_norm)(jnp.zeros(3)))
        [0. 0. 0.]
    """
    squared = jnp.sum(jnp.square(x), axis=-1)
    zero = squared == 0.0
    return jnp.where(zero, 0.0, jnp.sqrt(jnp.where(zero, 1.0, squared)))


def smoothstep(low: Scalar, high: Scalar, x: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """Cubic smoothstep S(low, high, x) = t²(3 − 2t), t = clip((x − low)/(high − low)).

    Rises from 0 at `low` to 1 at `high`, is constant outside and continuously
    differentiable everywhere.

    Args:
        low: where the rise begins.
        high: where the rise ends, > `low`, same unit as `x`.
        x: argument.

    Returns:
        Dimensionless values in [0, 1].

    Source:
        Paper, eq. (2), the function S.

    Examples:
        >>> print(smoothstep(1.0, 3.0, jnp.array([0.0, 2.0, 4.0])))
        [0.  0.5 1. ]
    """
    t = jnp.clip((x - low) / (high - low), 0.0, 1.0)
    return jnp.square(t) * (3.0 - 2.0 * t)


def tracking_kernel(error: Float[Array, " d"], width: Scalar) -> Float[Array, ""]:
    """Exponential tracking kernel exp(−|e|²/w²).

    The paper gives only the widths. The convention is Isaac Lab's, in which the paper
    was trained: w² divides without a factor 2, so the kernel falls to 1/e at |e| = w.

    Args:
        error: e, difference between commanded and actual quantity, any unit ([m/s]).
        width: w > 0, in the unit of `error`.

    Returns:
        Dimensionless value in (0, 1], 1 without error.

    Source:
        Isaac Lab, `track_lin_vel_xy_exp` and `track_ang_vel_z_exp`.
    """
    return jnp.exp(-jnp.sum(jnp.square(error / width)))
