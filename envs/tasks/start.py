"""First states of an episode."""

import jax
import jax.numpy as jnp
from jaxtyping import Array

from envs.hand.spec import HAND_NQ, JOINT_QPOS
from envs.physics import PhysicsState
from envs.plant import Plant
from envs.rotations import about_z, multiply
from envs.streams import stream


def near_stance(
    key: Array, plant: Plant, joint_rad: float, speed_mps: float
) -> PhysicsState:
    """The settled stance with noise, at a random heading; bodies of the task as built.

    Args:
        key: of the episode.
        plant: the hand and its stance.
        joint_rad: largest offset of a joint [rad]; the joint stays in its range.
        speed_mps: largest speed of the base along each axis [m/s].
    """
    pose, limits = plant.rest.state.qpos, plant.joint_range
    heading = about_z(
        jax.random.uniform(stream(key, "heading"), (), minval=-jnp.pi, maxval=jnp.pi)
    )
    joints = pose[JOINT_QPOS] + jax.random.uniform(
        stream(key, "joints"), (20,), minval=-joint_rad, maxval=joint_rad
    )
    vel = jax.random.uniform(
        stream(key, "speed"), (3,), minval=-speed_mps, maxval=speed_mps
    )
    qpos = jnp.concatenate(
        [
            pose[:3],
            multiply(heading, pose[3:7]),
            jnp.clip(joints, limits[:, 0], limits[:, 1]),
            pose[HAND_NQ:],
        ]
    )
    qvel = jnp.zeros(plant.mj_model.nv).at[:3].set(vel)
    return PhysicsState(qpos=qpos, qvel=qvel, qacc_warmstart=jnp.zeros_like(qvel))
