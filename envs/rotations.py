"""Unit quaternions w x y z as rotations, for one element; vmap for more."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def multiply(a: Float[Array, "4"], b: Float[Array, "4"]) -> Float[Array, "4"]:
    """Hamilton product a ⊗ b: first the rotation b, then a."""
    aw, av, bw, bv = a[0], a[1:], b[0], b[1:]
    w = aw * bw - jnp.sum(av * bv)
    return jnp.concatenate([w[None], aw * bv + bw * av + jnp.cross(av, bv)])


def conjugate(q: Float[Array, "4"]) -> Float[Array, "4"]:
    """The inverse rotation of a unit quaternion."""
    return q * jnp.array([1.0, -1.0, -1.0, -1.0])


def rotate(q: Float[Array, "4"], v: Float[Array, "3"]) -> Float[Array, "3"]:
    """Rotates v by q: q ⊗ v ⊗ q*."""
    t = 2.0 * jnp.cross(q[1:], v)
    return v + q[0] * t + jnp.cross(q[1:], t)


def unrotate(q: Float[Array, "4"], v: Float[Array, "3"]) -> Float[Array, "3"]:
    """Rotates v by the inverse of q: world components to those of the frame q."""
    return rotate(conjugate(q), v)


def about_z(angle_rad: Float[Array, ""]) -> Float[Array, "4"]:
    """Rotation about the z axis."""
    half = angle_rad / 2.0
    zero = jnp.zeros_like(half)
    return jnp.stack([jnp.cos(half), zero, zero, jnp.sin(half)])


def from_vector(rotation_rad: Float[Array, "3"]) -> Float[Array, "4"]:
    """Rotation about the vector's direction by its length; identity at zero."""
    half = rotation_rad / 2.0
    # jnp.sinc is finite, with its gradient, at zero.
    angle = jnp.sqrt(jnp.sum(half**2) + 1e-24)
    return jnp.concatenate([jnp.cos(angle)[None], jnp.sinc(angle / jnp.pi) * half])
