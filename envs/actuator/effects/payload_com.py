"""A payload whose centre of mass lies elsewhere than assumed."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, normal
from envs.actuator.surroundings import Gravity


def _shift(params: Params):
    axes = (params["x_m"], params["y_m"], params["z_m"])
    return jnp.stack(jnp.broadcast_arrays(*axes), axis=-1)


def _moved(params: Params, world: Gravity):
    """Sums in plain arithmetic: a product of 3 × 3 numbers costs more than the rest."""
    return jnp.sum(_shift(params)[..., None] * world.payload_shift, axis=-2)


def _load(params: Params, state, x, dt):
    """Turns the nominal weight of the payload about its new place."""
    world = x.around.gravity
    moment = _moved(params, world)
    torque = world.payload_kg * jnp.sum(moment * world.gravity, axis=-1)
    return state, x.replace(load=x.load + torque)


def _inertia(params: Params, state, x, dt):
    """Moves the nominal mass to another distance from the axis."""
    world = x.around.gravity
    moved = _moved(params, world)
    twice = jnp.sum((2.0 * world.payload_moment + moved) * moved, axis=-1)
    return state, x.replace(inertia=x.inertia + world.payload_kg * twice)


def _change(params: Params, scene, fields):
    ipos = fields["body_ipos"].at[scene.payload_body].add(_shift(params))
    return fields | {"body_ipos": ipos}


_AXIS = Parameter("m", -0.1, 0.1, normal(0.0, 0.01), identity=0.0)

EFFECT = EffectKind(
    name="payload_com",
    equation="r = r₀ + Δ, in the frame of the carrying body: Δτ = m₀ (a × Δ) · g, "
    "ΔI = m₀ (|a × r|² − |a × r₀|²)",
    parameters={"x_m": _AXIS, "y_m": _AXIS, "z_m": _AXIS},
    acts={Stage.LOAD: _load, Stage.INERTIA: _inertia},
    confusable_with={
        "payload_mass": "holds in several postures, and fast motion for the inertia",
        "mount_tilt": "another load: the shift scales with it",
        "encoder_offset": "another load",
        "encoder_eccentricity": "another load",
        "floor_tilt": "turn the hand: a tilt stays in the world",
        "finger_weakness": "lift one finger after the other",
    },
    source="J. Hollerbach et al., Model Identification, Springer Handbook of Robotics, "
    "2nd ed., ch. 6 (load estimation)",
    needs=("gravity",),
    changes_model=_change,
    scope="hand",
)
