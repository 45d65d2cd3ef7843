"""Domain randomization: what differs from world to world, and how it enters the model.

A draw holds for a world through all its episodes. The ranges of friction, gains, effort
and payload's place are the paper's; those of palm, IMU and noise are ours, the paper
naming the quantity only. The payload's mass is fixed, unless a stage of training is to
be without it.
"""

from dataclasses import dataclass, field
from typing import Any

import flax.struct
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from envs.errors import check_ordered
from envs.hand.spec import HandSpec
from envs.physics import ModelFields
from envs.streams import stream


@dataclass(frozen=True)
class RandomizeConfig:
    """Ranges of the draws; `no_randomization` gives the nominal hand.

    Attributes:
        tip_friction: sliding friction of all fingertips.
        gain_scale: factor on each joint's stiffness and, drawn apart, its damping.
        effort_scale: factor on all torque limits.
        payload_com_m: largest offset of the payload's centre of mass along the back
            (both directions) and away from it.
        payload_mass_scale: factor on the payload's mass and inertia; nearly nothing for
            a first stage without the dorsal module (ours).
        palm_mass_scale: factor on the palm's mass and inertia (ours).
        palm_com_m: largest offset of the palm's centre of mass, each axis (ours).
        imu_tilt_rad: largest mounting error of the IMU about each axis (ours).
        gyro_bias_rps: largest constant error of the gyro, each axis (ours).
        joint_noise_rad, gravity_noise, gyro_noise_rps: largest uniform noise of each
            sample (ours).
    """

    tip_friction: tuple[float, float] = field(
        default=(0.30, 1.30), metadata={"unit": "1", "low": 0.0}
    )
    gain_scale: tuple[float, float] = field(
        default=(0.78, 1.22), metadata={"unit": "1", "low": 0.01}
    )
    effort_scale: tuple[float, float] = field(
        default=(1.0, 1.5), metadata={"unit": "1", "low": 0.01}
    )
    payload_com_m: tuple[float, float] = field(
        default=(0.010, 0.015), metadata={"unit": "m", "low": 0.0}
    )
    payload_mass_scale: tuple[float, float] = field(
        default=(1.0, 1.0), metadata={"unit": "1", "low": 1e-3}
    )
    palm_mass_scale: tuple[float, float] = field(
        default=(0.9, 1.1), metadata={"unit": "1", "low": 0.01}
    )
    palm_com_m: float = field(default=0.005, metadata={"unit": "m", "low": 0.0})
    imu_tilt_rad: float = field(default=0.03, metadata={"unit": "rad", "low": 0.0})
    gyro_bias_rps: float = field(default=0.05, metadata={"unit": "rad/s", "low": 0.0})
    joint_noise_rad: float = field(default=0.005, metadata={"unit": "rad", "low": 0.0})
    gravity_noise: float = field(default=0.01, metadata={"unit": "1", "low": 0.0})
    gyro_noise_rps: float = field(default=0.05, metadata={"unit": "rad/s", "low": 0.0})

    def __post_init__(self) -> None:
        masses = ("payload_mass_scale", "palm_mass_scale")
        check_ordered(self, "tip_friction", "gain_scale", "effort_scale", *masses)


def no_randomization(tip_friction: float) -> RandomizeConfig:
    """The nominal hand: every range is a point and every noise zero."""
    one = (1.0, 1.0)
    return RandomizeConfig(
        (tip_friction, tip_friction), one, one, (0.0, 0.0), one, one, *([0.0] * 6)
    )


@flax.struct.dataclass
class Variation:
    """One world's draw; units as in `RandomizeConfig`."""

    tip_friction: Float[Array, "*b"]
    stiffness_scale: Float[Array, "*b 20"]
    damping_scale: Float[Array, "*b 20"]
    effort_scale: Float[Array, "*b"]
    payload_com_m: Float[Array, "*b 3"]
    payload_mass_scale: Float[Array, "*b"]
    palm_mass_scale: Float[Array, "*b"]
    palm_com_m: Float[Array, "*b 3"]
    imu_rotation_rad: Float[Array, "*b 3"]
    gyro_bias_rps: Float[Array, "*b 3"]


def draw_variation(key: PRNGKeyArray, config: RandomizeConfig) -> Variation:
    """Draws one world: x = U(low, high) for each quantity [rad, m, 1].

    Each quantity has a stream of its own, so that a new one leaves the others as they
    were.

    Args:
        key: of the draw.
        config: the ranges.

    Source:
        Paper, domain randomization (friction, gains, effort, payload); palm, IMU and
        noise ours.
    """

    def uniform(name: str, shape: tuple[int, ...], low: Any, high: Any) -> Array:
        return jax.random.uniform(stream(key, name), shape, minval=low, maxval=high)

    def within(name: str, bound: Any) -> Array:
        bound = jnp.asarray(bound)
        return uniform(name, (3,), -bound, bound)

    along, away = config.payload_com_m
    return Variation(
        tip_friction=uniform("tip_friction", (), *config.tip_friction),
        stiffness_scale=uniform("stiffness_scale", (20,), *config.gain_scale),
        damping_scale=uniform("damping_scale", (20,), *config.gain_scale),
        effort_scale=uniform("effort_scale", (), *config.effort_scale),
        # The palm's x is normal to its back.
        payload_com_m=within("payload_com", [away, along, along]),
        payload_mass_scale=uniform("payload_mass", (), *config.payload_mass_scale),
        palm_mass_scale=uniform("palm_mass", (), *config.palm_mass_scale),
        palm_com_m=within("palm_com", config.palm_com_m),
        imu_rotation_rad=within("imu_tilt", config.imu_tilt_rad),
        gyro_bias_rps=within("gyro_bias", config.gyro_bias_rps),
    )


def model_fields(
    model: mujoco.MjModel, spec: HandSpec, variation: Variation
) -> ModelFields:
    """The model fields of a varied world, all that changes and nothing else.

    Subtree masses follow those of palm and payload. The inverse weights that scale the
    softness of constraints stay the nominal ones, on every backend.
    """
    palm, payload = spec.palm_body, spec.payload_body
    bodies = np.array([palm, payload])
    scale = jnp.stack([variation.palm_mass_scale, variation.payload_mass_scale])
    added = (scale - 1.0) * model.body_mass[bodies]
    gain = jnp.asarray(model.actuator_gainprm)
    bias = jnp.asarray(model.actuator_biasprm)
    tips = jnp.array(spec.tip_geoms)
    return {
        "geom_friction": jnp.asarray(model.geom_friction)
        .at[tips, 0]
        .set(variation.tip_friction),
        "actuator_gainprm": gain.at[:, 0].multiply(variation.stiffness_scale),
        "actuator_biasprm": bias.at[:, 1]
        .multiply(variation.stiffness_scale)
        .at[:, 2]
        .multiply(variation.damping_scale),
        "actuator_forcerange": jnp.asarray(model.actuator_forcerange)
        * variation.effort_scale,
        "body_mass": jnp.asarray(model.body_mass).at[bodies].multiply(scale),
        "body_inertia": jnp.asarray(model.body_inertia)
        .at[bodies]
        .multiply(scale[:, None]),
        "body_ipos": jnp.asarray(model.body_ipos)
        .at[palm]
        .add(variation.palm_com_m)
        .at[payload]
        .add(variation.payload_com_m),
        "body_subtreemass": jnp.asarray(model.body_subtreemass)
        .at[jnp.array([0, palm])]
        .add(added[0] + added[1])
        .at[payload]
        .add(added[1]),
    }
