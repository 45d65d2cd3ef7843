"""What surrounds a joint at one step of its measured motion, for all candidates."""

from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from envs.actuator.surroundings import Gravity, Surroundings
from envs.actuator.trigonometry import sine_cosine
from sysid.diagnosis.replay.motion import Motion, Track


def surroundings_at(
    track: Track,
    now: Motion,
    away: Float[Array, "p c"],
    mass: Float[Array, "1 c"],
    push_gain: Float[Array, "1 c"],
) -> tuple[Surroundings, Float[Array, "p c"]]:
    """Gravity, neighbours and load: τ_load = μ push + β ext + m(x) · g.

    The moment of the carried masses turns with the joint, and so do those of a payload:

        m(x) = μ (m cos x + a × m sin x)

    about the axis a, for an angle x from the measured one. A moment that stayed would
    pull the simulated joint to where the measured one was.

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
    turn = partial(turned, now.axis, away[..., None])
    moment = mass[..., None] * turn(now.moment)
    gravity = jnp.broadcast_to(track.gravity[:, None], moment.shape)
    load = mass * now.push + push_gain * now.ext + jnp.sum(moment * gravity, -1)
    payload_kg = jnp.broadcast_to(track.payload_kg[:, None], away.shape)
    around = Surroundings(
        others_nm=now.others_nm,
        other_q=now.other_q,
        other_nm=now.other_nm,
        gravity=Gravity(
            gravity=gravity,
            moment=moment,
            payload_kg=payload_kg,
            payload_moment=turn(now.payload_moment),
            payload_shift=jax.vmap(turn, -2, -2)(now.payload_shift),
            payload_inertia=now.payload_inertia,
            payload_push=now.payload_push,
        ),
    )
    return around, load


def turned(
    axis: Float[Array, "*#b 3"], angle: Float[Array, "*#b 1"], v: Float[Array, "*#b 3"]
) -> Float[Array, "*#b 3"]:
    """Turns vectors about a hinge to which they are normal; a slide leaves them.

        v' = v cos x + a × v sin x; without an axis v' = v

    Args:
        axis: a, of unit length; 0 for a slide [1].
        angle: x [rad].
        v: normal to the axis.

    Source:
        Rodrigues' rotation formula.
    """
    hinge = jnp.sum(axis**2, -1, keepdims=True)
    sine, cosine = sine_cosine(angle)
    return (1.0 - hinge * (1.0 - cosine)) * v + sine * jnp.cross(axis, v)
