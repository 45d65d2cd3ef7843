"""An IMU whose axes are not those of the palm."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, normal
from envs.rotations import from_vector, rotate


def _sense(params: Params, imu):
    turn = from_vector(jnp.stack([params["x_rad"], params["y_rad"], params["z_rad"]]))
    return imu.replace(
        gravity=rotate(turn, imu.gravity), angvel=rotate(turn, imu.angvel)
    )


_AXIS = Parameter("rad", -0.5, 0.5, normal(0.0, 0.03), identity=0.0)

EFFECT = EffectKind(
    name="imu_misalignment",
    equation="ω' = R ω, g' = R g, with the rotation R of a vector",
    parameters={"x_rad": _AXIS, "y_rad": _AXIS, "z_rad": _AXIS},
    acts={},
    confusable_with={
        "imu_bias": "rest: a bias remains, a turned axis measures zero",
        "floor_tilt": "turn the hand: an IMU turns with it",
    },
    source="O. Woodman, An Introduction to Inertial Navigation, University of "
    "Cambridge, UCAM-CL-TR-696, 2007 (calibration errors)",
    senses=_sense,
    scope="hand",
)
