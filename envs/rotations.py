"""Unit quaternions w x y z as rotations, for one element; vmap for more."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def multiply(a: Float[Array, "4"], b: Float[Array, "4"]) -> Float[Array, "4"]:
    """Hamilton product a ⊗ b = (a_w b_w − a·b, a_w b + b_w a + a × b).

    First the rotation b, then a; unit quaternions [1] give one.

    Source:
        Shoemake, "Animating Rotation with Quaternion Curves" (1985).
    """
    aw, av, bw, bv = a[0], a[1:], b[0], b[1:]
    w = aw * bw - jnp.sum(av * bv)
    return jnp.concatenate([w[None], aw * bv + bw * av + jnp.cross(av, bv)])


def conjugate(q: Float[Array, "4"]) -> Float[Array, "4"]:
    """The inverse rotation q* = (w, −x, −y, −z) of a unit quaternion [1].

    Source:
        Shoemake, "Animating Rotation with Quaternion Curves" (1985).
    """
    return q * jnp.array([1.0, -1.0, -1.0, -1.0])


def rotate(q: Float[Array, "4"], v: Float[Array, "3"]) -> Float[Array, "3"]:
    """Rotates v by q: q ⊗ v ⊗ q* = v + 2 (w u + d × u), u = d × v, d = (x, y, z).

    Args:
        q: unit quaternion [1].
        v: a vector of any unit, which is that of the result.

    Source:
        Shoemake, "Animating Rotation with Quaternion Curves" (1985).
    """
    t = 2.0 * jnp.cross(q[1:], v)
    return v + q[0] * t + jnp.cross(q[1:], t)


def unrotate(q: Float[Array, "4"], v: Float[Array, "3"]) -> Float[Array, "3"]:
    """Rotates v by the inverse of q, v_q = q* ⊗ v ⊗ q: world to frame components.

    Args:
        q: unit quaternion [1], the orientation of the frame in the world.
        v: a vector of any unit, which is that of the result.

    Source:
        Shoemake, "Animating Rotation with Quaternion Curves" (1985).
    """
    return rotate(conjugate(q), v)


def about_z(angle_rad: Float[Array, ""]) -> Float[Array, "4"]:
    """Rotation about the z axis, q = (cos ψ/2, 0, 0, sin ψ/2) [1].

    Args:
        angle_rad: ψ [rad].

    Source:
        Shoemake, "Animating Rotation with Quaternion Curves" (1985).
    """
    half = angle_rad / 2.0
    zero = jnp.zeros_like(half)
    return jnp.stack([jnp.cos(half), zero, zero, jnp.sin(half)])


def from_vector(rotation_rad: Float[Array, "3"]) -> Float[Array, "4"]:
    """Rotation about the direction of a vector r by its length, exp(r/2).

    (cos |r|/2, sin(|r|/2) r/|r|) [1], the identity at zero, where the gradient is
    finite.

    Args:
        rotation_rad: r [rad].

    Source:
        Grassia, "Practical Parameterization of Rotations Using the Exponential Map"
        (1998).
    """
    half = rotation_rad / 2.0
    # jnp.sinc is finite, with its gradient, at zero.
    angle = jnp.sqrt(jnp.sum(half**2) + 1e-24)
    return jnp.concatenate([jnp.cos(angle)[None], jnp.sinc(angle / jnp.pi) * half])
