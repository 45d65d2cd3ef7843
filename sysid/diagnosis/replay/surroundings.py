"""What surrounds a joint at one step of its measured motion, for all candidates."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from envs.actuator.surroundings import Gravity, Surroundings
from sysid.diagnosis.replay.motion import Motion, Track


def surroundings_at(
    track: Track,
    now: Motion,
    away: Float[Array, "p c"],
    mass: Float[Array, "1 c"],
    push_gain: Float[Array, "1 c"],
) -> tuple[Surroundings, Float[Array, "p c"]]:
    """Gravity, neighbours and load: τ_load = μ push + β ext + m(x) · g.

    The moment of the carried masses turns with the joint: m(x) = μ (m cos x + m⊥ sin x)
    for an angle x from the measured one.

    Args:
        track: gravity [m/s²] and payload [kg] of the pieces.
        now: one step of the motion, with a last axis for the candidates.
        away: x, angle of the link less the measured one [rad].
        mass: μ, factor of masses and inertias [1].
        push_gain: β, factor of the known push [1].

    Returns:
        Surroundings for `chain_step`, and the load [N·m].

    Source:
        Ours; gravity's torque m · g as in `envs.actuator.surroundings.Gravity`.
    """
    away = away[..., None]
    moment = jnp.cos(away) * now.moment + jnp.sin(away) * now.turned
    moment = mass[..., None] * moment
    gravity = jnp.broadcast_to(track.gravity[:, None], moment.shape)
    load = mass * now.push + push_gain * now.ext + jnp.sum(moment * gravity, -1)
    payload_kg = jnp.broadcast_to(track.payload_kg[:, None], away.shape[:-1])
    around = Surroundings(
        others_nm=now.others_nm,
        other_q=now.other_q,
        other_nm=now.other_nm,
        gravity=Gravity(
            gravity=gravity,
            moment=moment,
            payload_kg=payload_kg,
            payload_moment=now.payload_moment,
            payload_shift=now.payload_shift,
            payload_inertia=now.payload_inertia,
            payload_push=now.payload_push,
        ),
    )
    return around, load
