"""Group axioms for any unit quaternion, and MuJoCo's own functions as oracle."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from hypothesis import strategies as st
from support.properties import counts, holds

from envs.rotations import about_z, conjugate, from_vector, multiply, rotate, unrotate
from envs.signals import gravity, tilt

VECTOR = st.tuples(*[st.floats(-100.0, 100.0, width=32)] * 3).map(np.float32)
QUATERNION = (
    st.tuples(*[st.floats(-1.0, 1.0, width=32)] * 4)
    .map(np.float32)
    .filter(lambda q: np.linalg.norm(q) > 0.1)
    .map(lambda q: q / np.linalg.norm(q))
)
product, turn, unturn = jax.jit(multiply), jax.jit(rotate), jax.jit(unrotate)
inverse, from_rotation = jax.jit(conjugate), jax.jit(from_vector)
down, leaning = jax.jit(gravity), jax.jit(tilt)


@counts
def test_product_and_rotation_are_those_of_mujoco(count):
    def check(a, b, v):
        expected, turned = np.zeros(4), np.zeros(3)
        mujoco.mju_mulQuat(expected, a.astype(float), b.astype(float))
        np.testing.assert_allclose(product(a, b), expected, atol=1e-6)
        mujoco.mju_rotVecQuat(turned, v.astype(float), a.astype(float))
        bound = 5e-6 * (1 + np.abs(v).max())
        np.testing.assert_allclose(turn(a, v), turned, atol=bound)

    holds(count, check, QUATERNION, QUATERNION, VECTOR)


@counts
def test_rotations_are_a_group_that_keeps_lengths(count):
    def check(a, b, v):
        bound = 1e-5 * (1 + np.abs(v).max())
        assert abs(np.linalg.norm(product(a, b)) - 1) < 1e-6
        assert abs(np.linalg.norm(turn(a, v)) - np.linalg.norm(v)) < bound
        np.testing.assert_allclose(unturn(a, turn(a, v)), v, atol=bound)
        twice = turn(a, turn(b, v))
        np.testing.assert_allclose(turn(product(a, b), v), twice, atol=bound)
        np.testing.assert_allclose(product(a, inverse(a)), [1, 0, 0, 0], atol=1e-6)

    holds(count, check, QUATERNION, QUATERNION, VECTOR)


@counts
def test_gravity_is_a_unit_vector_and_tilt_an_angle(count):
    def check(q):
        assert abs(np.linalg.norm(down(q)) - 1) < 1e-6
        roll, pitch = np.asarray(leaning(q))
        assert abs(roll) <= np.float32(np.pi) and abs(pitch) <= np.float32(np.pi / 2)

    holds(count, check, QUATERNION)


@counts
def test_the_rotation_of_a_vector_is_a_unit_quaternion(count):
    def check(v):
        assert abs(np.linalg.norm(from_rotation(v / 10)) - 1) < 1e-6

    holds(count, check, VECTOR)


def test_rotation_vectors_and_headings():
    expected = [np.cos(0.35), 0, 0, np.sin(0.35)]
    np.testing.assert_allclose(about_z(jnp.float32(0.7)), expected, atol=1e-7)
    np.testing.assert_allclose(
        from_rotation(np.float32([0, 0, 0.7])), expected, atol=1e-6
    )
    np.testing.assert_allclose(
        from_rotation(np.zeros(3, np.float32)), [1, 0, 0, 0], atol=1e-7
    )
    gradient = jax.jacobian(from_vector)(jnp.zeros(3))
    np.testing.assert_allclose(gradient[1:], 0.5 * np.eye(3), atol=1e-6)
