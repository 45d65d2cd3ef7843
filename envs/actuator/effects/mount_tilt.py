"""A mount that is not as level as assumed."""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, normal
from envs.actuator.trigonometry import sine_cosine


def tilted(
    gravity: Float[ArrayLike, "*#j 3"],
    roll: Float[ArrayLike, "*#j"],
    pitch: Float[ArrayLike, "*#j"],
) -> Float[Array, "*j 3"]:
    """Gravity in a turned frame: g' = R(ρ)ᵀ g, ρ = (roll, pitch, 0) [m/s²].

    R is the rotation by |ρ| about ρ, as a quaternion (cos |ρ|/2, sinc(|ρ|/2) ρ/2).

    Args:
        gravity: g in the frame that is level [m/s²].
        roll: angle about x [rad].
        pitch: angle about y [rad].

    Source:
        J. Solà, Quaternion kinematics for the error-state Kalman filter, arXiv
        1711.02508 (rotation vector to quaternion).
    """
    gravity = jnp.asarray(gravity)
    turn = jnp.stack(jnp.broadcast_arrays(roll, pitch, 0.0), axis=-1)
    half = -0.5 * turn
    angle = jnp.sqrt(jnp.sum(half**2, axis=-1, keepdims=True) + 1e-24)
    sine, cosine = sine_cosine(angle)
    vector = sine / angle * half
    moved = 2.0 * jnp.cross(vector, gravity)
    return gravity + cosine * moved + jnp.cross(vector, moved)


def _load(params: Params, state, x, dt):
    """Turns gravity, for this effect's torque and for those of later ones."""
    world = x.around.gravity
    gravity = tilted(world.gravity, params["roll_rad"], params["pitch_rad"])
    change = jnp.sum(world.moment * (gravity - world.gravity), axis=-1)
    around = x.around.replace(gravity=world.replace(gravity=gravity))
    return state, x.replace(load=x.load + change, around=around)


_ANGLE = Parameter("rad", -1.5, 1.5, normal(0.0, 0.03), identity=0.0)

EFFECT = EffectKind(
    name="mount_tilt",
    equation="g = R(roll, pitch)ᵀ g₀ in the frame of the mount: Δτ = m · (g − g₀)",
    parameters={"roll_rad": _ANGLE, "pitch_rad": _ANGLE},
    acts={Stage.LOAD: _load},
    confusable_with={
        "encoder_offset": "holds in several postures: tilt turns with gravity",
        "asymmetric_friction": "at rest: an asymmetry of friction is gone",
        "payload_com": "another load: the shift scales with it",
        "joint_coupling": "move the other joint alone",
    },
    source="ours, gravity in a turned frame",
    needs=("gravity",),
    scope="hand",
)
