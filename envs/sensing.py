"""The sensors of one world: what encoders and IMU measure, with bias and noise."""

import jax
from jaxtyping import Array, Float

from envs.actuator.surroundings import Imu
from envs.memory import PerWorldState
from envs.observations import Sample
from envs.physics import PhysicsState
from envs.randomize import RandomizeConfig
from envs.rotations import from_vector, rotate, unrotate
from envs.streams import stream
from rewards import safe_norm


def imu_of(data: PhysicsState, down_w: Float[Array, "3"]) -> Imu:
    """What an IMU in the palm measures without error.

    Args:
        data: the state that is measured.
        down_w: unit vector of gravity in the world.
    """
    return Imu(gravity=unrotate(data.qpos[3:7], down_w), angvel=data.qvel[3:6])


def sense(
    config: RandomizeConfig,
    world: PerWorldState,
    joint_pos: Float[Array, "20"],
    imu: Imu,
    action: Float[Array, "20"],
) -> Sample:
    """What the actor observes of one control step, but for the task's inputs.

    Args:
        config: bounds of the noise.
        world: the world's biases, and what its fresh noise is drawn from.
        joint_pos: joint angles less those that read as zero [rad].
        imu: what a perfectly mounted IMU measures.
        action: last clipped policy output.
    """
    variation = world.variation
    key = world.step_key("noise")

    def noisy(name: str, value: Array, bound: float) -> Array:
        noise = jax.random.uniform(stream(key, name), value.shape, minval=-1.0)
        return value + bound * noise

    mounting = from_vector(variation.imu_rotation_rad)
    down = noisy("gravity", imu.gravity, config.gravity_noise)
    angvel = imu.angvel + variation.gyro_bias_rps
    return Sample(
        joint_pos=noisy("joints", joint_pos, config.joint_noise_rad),
        gravity=rotate(mounting, down / safe_norm(down)),
        angvel=noisy("gyro", rotate(mounting, angvel), config.gyro_noise_rps),
        action=action,
    )
