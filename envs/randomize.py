"""Domain randomization: what differs from world to world, and how it enters the model.

A draw holds for a world through all its episodes. The ranges of friction, gains, effort
and payload's place are the paper's; those of palm, IMU and noise are ours, the paper
naming the quantity only. The payload's mass is fixed, unless a stage of training is to
be without it.
"""

from typing import Any

import flax.struct
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from envs.config.settings.randomize import RandomizeConfig as RandomizeConfig
from envs.config.settings.randomize import no_randomization as no_randomization
from envs.hand.spec import HandSpec
from envs.physics.base import ModelFields
from envs.streams import stream


@flax.struct.dataclass
class Variation:
    """One world's draw; units as in `RandomizeConfig`."""

    tip_friction: Float[Array, "*b"]
    stiffness_scale: Float[Array, "*b joints"]
    damping_scale: Float[Array, "*b joints"]
    effort_scale: Float[Array, "*b"]
    payload_com_m: Float[Array, "*b 3"]
    payload_mass_scale: Float[Array, "*b"]
    palm_mass_scale: Float[Array, "*b"]
    palm_com_m: Float[Array, "*b 3"]
    imu_rotation_rad: Float[Array, "*b 3"]
    gyro_bias_rps: Float[Array, "*b 3"]


def draw_variation(
    key: PRNGKeyArray, config: RandomizeConfig, joints: int
) -> Variation:
    """Draws one world: x = U(low, high) for each quantity [rad, m, 1].

    Each quantity has a stream of its own, so that a new one leaves the others as they
    were.

    Args:
        key: of the draw.
        config: the ranges.
        joints: joints of the hand.

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
        stiffness_scale=uniform("stiffness_scale", (joints,), *config.gain_scale),
        damping_scale=uniform("damping_scale", (joints,), *config.gain_scale),
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
