"""A payload that is heavier than assumed."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, normal


def _load(params: Params, state, x, dt):
    """Adds weight and push of the mass where the caller carries its payload."""
    mass, world = params["mass_kg"], x.around.gravity
    per_kg = jnp.sum(world.payload_moment * world.gravity, axis=-1)
    per_kg = per_kg + world.payload_push
    return state, x.replace(load=x.load + mass * per_kg)


def _inertia(params: Params, state, x, dt):
    added = params["mass_kg"] * x.around.gravity.payload_inertia
    return state, x.replace(inertia=x.inertia + added)


def _change(params: Params, scene, fields):
    """Adds the mass to the payload's body, with the inertia of its shape."""
    body, mass = scene.payload_body, params["mass_kg"]
    grown = 1.0 + mass / fields["body_mass"][body]
    return fields | {
        "body_mass": fields["body_mass"].at[body].add(mass),
        "body_inertia": fields["body_inertia"].at[body].multiply(grown),
        "body_subtreemass": fields["body_subtreemass"]
        .at[jnp.array(scene.above_payload)]
        .add(mass),
    }


EFFECT = EffectKind(
    name="payload_mass",
    equation="m = m₀ + Δm, spread as m₀ is: Δτ = Δm ((a × r) · (g − r̈ₒ) − a · J ω̇ₒ), "
    "ΔI = Δm (|a × r|² + a · J a), with J = I₀ / m₀ and the accelerations r̈ₒ and ω̇ₒ by "
    "the other joints",
    parameters={
        "mass_kg": Parameter("kg", -0.07, 1.0, normal(0.0, 0.02), identity=0.0)
    },
    acts={Stage.LOAD: _load, Stage.INERTIA: _inertia},
    confusable_with={
        "armature": "holds in several postures: rotors have no weight there",
        "stiffness": "effort at rest: a load changes it, a gain does not",
        "encoder_scale": "the whole range without load",
        "payload_com": "holds in several postures, and fast motion for the inertia",
        "joint_coupling": "move the other joint alone, without load",
    },
    source="J. Hollerbach et al., Model Identification, Springer Handbook of Robotics, "
    "2nd ed., ch. 6 (load estimation)",
    needs=("gravity",),
    changes_model=_change,
    scope="hand",
)
