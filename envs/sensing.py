"""The sensors of one world: what encoders and IMU tell, with bias and noise."""

import jax
from jaxtyping import Array, Float

from envs.hand.spec import JOINT_QPOS
from envs.memory import Lasting
from envs.observations import Sample
from envs.physics import PhysicsState
from envs.randomize import RandomizeConfig
from envs.rotations import from_vector, rotate
from envs.signals import gravity
from envs.streams import stream
from rewards import safe_norm


def sense(
    config: RandomizeConfig,
    lasting: Lasting,
    reference_rad: Float[Array, "20"],
    data: PhysicsState,
    action: Float[Array, "20"],
) -> Sample:
    """What the actor is told of one control step, but for the task's inputs.

    Args:
        config: bounds of the noise.
        lasting: the world's biases, and what its fresh noise is drawn from.
        reference_rad: joint angles that read as zero [rad].
        data: the state that is measured.
        action: last clipped policy output.
    """
    variation = lasting.variation
    key = jax.random.fold_in(stream(lasting.key, "noise"), lasting.total_steps)
    key = jax.random.fold_in(key, lasting.episodes)

    def noisy(name: str, value: Array, bound: float) -> Array:
        noise = jax.random.uniform(stream(key, name), value.shape, minval=-1.0)
        return value + bound * noise

    imu = from_vector(variation.imu_rotation_rad)
    joints = data.qpos[JOINT_QPOS] - reference_rad
    down = noisy("gravity", gravity(data.qpos[3:7]), config.gravity_noise)
    angvel = data.qvel[3:6] + variation.gyro_bias_rps
    return Sample(
        joint_pos=noisy("joints", joints, config.joint_noise_rad),
        gravity=rotate(imu, down / safe_norm(down)),
        angvel=noisy("gyro", rotate(imu, angvel), config.gyro_noise_rps),
        action=action,
    )
