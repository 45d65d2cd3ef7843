"""The sensors of one world: what encoders and IMU measure, with bias and noise."""

import jax
from jaxtyping import Array, Float

from envs.actuator.surroundings import Imu
from envs.memory import PerWorldState
from envs.observations import Sample
from envs.physics.base import PhysicsState
from envs.randomize import RandomizeConfig
from envs.rotations import from_vector, rotate, unrotate
from envs.streams import stream
from rewards import safe_norm


def imu_of(data: PhysicsState, down_w: Float[Array, "3"]) -> Imu:
    """An IMU in the palm without error: g = Rᵀ d [1], ω = body rate [rad/s].

    Args:
        data: the state that is measured.
        down_w: d, unit vector of gravity in the world.

    Source:
        O. Woodman, An Introduction to Inertial Navigation, University of Cambridge,
        UCAM-CL-TR-696, 2007.
    """
    return Imu(gravity=unrotate(data.qpos[3:7], down_w), angvel=data.qvel[3:6])


def sense(
    config: RandomizeConfig,
    world: PerWorldState,
    joint_pos: Float[Array, " joints"],
    imu: Imu,
    action: Float[Array, " joints"],
) -> Sample:
    """What the actor observes of one control step, without the task's inputs.

        q̂ = q + n_q,   ĝ = R (g + n_g) / |g + n_g|,   ω̂ = R (ω + b) + n_ω

    with the mounting error R, the gyro's bias b and fresh uniform noise n.

    Args:
        config: bounds of the noise.
        world: the world's biases, and what its fresh noise is drawn from.
        joint_pos: joint angles less those that read as zero [rad].
        imu: gravity g [1] and angular velocity ω [rad/s] of a perfectly mounted IMU.
        action: last clipped policy output [1].

    Source:
        Paper, policy interfaces and domain randomization; sizes of bias and noise ours.
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
