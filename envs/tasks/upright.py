"""What tasks of a standing hand share: settings, first state, and when it fell."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from envs.config.settings.hand import UprightSettings as UprightSettings
from envs.physics.base import PhysicsState
from envs.plant import Plant
from envs.rotations import about_z, multiply
from envs.signals import Signals
from envs.streams import stream


def fallen(signals: Signals, limits: UprightSettings) -> Bool[Array, ""]:
    """Palm contact, or V tilted beyond the limits.

    fallen = c_palm ∨ |roll| > r ∨ |pitch| > p.

    Args:
        signals: of this step.
        limits: with r and p [deg].

    Returns:
        One flag [1].

    Source:
        Paper, crawling.
    """
    most = jnp.deg2rad(jnp.array([limits.max_roll_deg, limits.max_pitch_deg]))
    return jnp.any(jnp.abs(signals.tilt_rad) > most) | (signals.palm_contact > 0)


def near_stance(
    key: PRNGKeyArray, plant: Plant, joint_rad: float, speed_mps: float
) -> PhysicsState:
    """The settled stance with noise, at a random heading; bodies of the task as built.

    Args:
        key: of the episode.
        plant: the hand and its stance.
        joint_rad: largest offset of a joint [rad].
        speed_mps: largest speed of the base along each axis [m/s].
    """
    pose = plant.rest.state.qpos
    vel = jax.random.uniform(
        stream(key, "speed"), (3,), minval=-speed_mps, maxval=speed_mps
    )
    qpos = jnp.concatenate(
        [
            pose[:3],
            multiply(random_heading(key), pose[3:7]),
            near_joints(key, plant, joint_rad),
            pose[plant.spec.nq :],
        ]
    )
    qvel = jnp.zeros(plant.mj_model.nv).at[:3].set(vel)
    return PhysicsState(qpos=qpos, qvel=qvel, qacc_warmstart=jnp.zeros_like(qvel))


def near_joints(
    key: PRNGKeyArray, plant: Plant, most_rad: float
) -> Float[Array, " joints"]:
    """Joints of the stance with noise, q = clip(q* + u, limits), u ∈ [−b, b] at random.

    Args:
        key: of the episode.
        plant: the hand and its stance q*.
        most_rad: b [rad].

    Returns:
        Joint angles [rad].

    Source:
        Ours.
    """
    noise = jax.random.uniform(
        stream(key, "joints"),
        plant.joint_range.shape[:1],
        minval=-most_rad,
        maxval=most_rad,
    )
    low, high = plant.joint_range[:, 0], plant.joint_range[:, 1]
    return jnp.clip(plant.rest.state.qpos[plant.spec.joint_qpos] + noise, low, high)


def random_heading(key: PRNGKeyArray) -> Float[Array, "4"]:
    """Turn about the vertical by ψ ∈ [−π, π] [rad], uniform, as w x y z [1].

    Source:
        Paper, fall recovery (a random heading); ours in the other tasks.
    """
    return about_z(
        jax.random.uniform(stream(key, "heading"), (), minval=-jnp.pi, maxval=jnp.pi)
    )
