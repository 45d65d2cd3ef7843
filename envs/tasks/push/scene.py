"""The cube that is pushed: its body in the scene, and where episodes put it."""

import jax
import jax.numpy as jnp
import mujoco
from jaxtyping import Array, Float, PRNGKeyArray

from envs.physics.base import PhysicsState
from envs.rotations import about_z
from envs.streams import stream

CUBE = "cube"
HALF_M = 0.020
MASS_KG = 0.0414
POS, VEL = slice(-7, -4), slice(-6, -3)
"""Where position and velocity of the cube stand in `PhysicsState`: after the hand's."""

_AWAY_M = 0.5
_COLOUR = (0.35, 0.55, 0.30, 1.0)


def add_cube(spec: mujoco.MjSpec, friction: float) -> None:
    """Adds the cube of 40 mm and 41.4 g (paper), ahead of the hand.

    Args:
        spec: the scene.
        friction: sliding friction on the floor; against a hand, the larger one counts.
    """
    cube = spec.worldbody.add_body(name=CUBE, pos=[_AWAY_M, 0, HALF_M])
    cube.add_freejoint(name=CUBE)
    cube.add_geom(
        name=CUBE,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[HALF_M] * 3,
        mass=MASS_KG,
        friction=[friction, 0.005, 0.0001],
        condim=3,
        # Floor (1) and hand (2) look for it; a priority like the hand's, above floor's.
        contype=0,
        conaffinity=3,
        priority=1,
        rgba=_COLOUR,
    )


def place_cube(
    key: PRNGKeyArray, state: PhysicsState, pos_w: Float[Array, "2"]
) -> PhysicsState:
    """Puts the cube on the floor at rest, turned by a uniform ψ ∈ [0, π/2].

    Args:
        key: of the episode.
        state: of the scene.
        pos_w: where, on the floor [m].

    Source:
        Ours.
    """
    turn = jax.random.uniform(stream(key, "cube_turn"), (), maxval=jnp.pi / 2)
    pose = jnp.concatenate([pos_w, jnp.array([HALF_M]), about_z(turn)])
    return state.replace(qpos=state.qpos.at[-7:].set(pose))
