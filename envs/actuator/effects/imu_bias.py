"""A gyro that turns while it rests."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, normal


def _sense(params: Params, imu):
    bias = jnp.stack([params["x_rad_s"], params["y_rad_s"], params["z_rad_s"]])
    return imu.replace(angvel=imu.angvel + bias)


_AXIS = Parameter("rad/s", -1.0, 1.0, normal(0.0, 0.02), identity=0.0)

EFFECT = EffectKind(
    name="imu_bias",
    equation="ω' = ω + b, in the frame of the IMU",
    parameters={"x_rad_s": _AXIS, "y_rad_s": _AXIS, "z_rad_s": _AXIS},
    acts={},
    confusable_with={
        "imu_misalignment": "rest: a bias remains, a turned axis measures zero",
    },
    source="O. Woodman, An Introduction to Inertial Navigation, University of "
    "Cambridge, UCAM-CL-TR-696, 2007",
    senses=_sense,
    scope="hand",
)
