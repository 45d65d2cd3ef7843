"""Play whose motor has an inertia, as the simulation of one joint needs it.

The catalogue's play lets a free motor follow its servo at once: that takes no parameter
and little of a hand's time. But a light link hangs behind most gears, and half of all
that turns may be the motor: it crosses the gap as its inertia lets it, and rings there,
for what damps motor and link together need not damp the motor alone. A motor without
inertia may leave more than half of what a play makes of an angle.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import flax.struct
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from envs.actuator.effect import EffectKind, Params, Stage, Substep
from sysid.diagnosis.replay.effects import KINDS
from sysid.diagnosis.replay.link import MOST_ROTOR
from sysid.diagnosis.replay.model import Nuisance

NAME = "backlash"
SPRING = "compliance"


@flax.struct.dataclass
class Play:
    """Motor against joint after a substep, as far as the joint's speed does not matter.

    Attributes:
        lead: angle of the motor less that of the joint [rad].
        ahead: speed of the motor less that of the joint [rad/s].
        wall: 1 or −1 where the motor touches, 0 between the walls.
        heavy: H, momentum per speed and time that the motor has and its servo damps
            [N·m·s/rad]; 0 before the first substep.
        base: H v_m + τ [N·m].
    """

    lead: Float[Array, "*j"]
    ahead: Float[Array, "*j"]
    wall: Float[Array, "*j"]
    heavy: Float[Array, "*j"]
    base: Float[Array, "*j"]


def moved(params: Params, play: Play, speed: Float[Array, "*j"], dt: float) -> Play:
    """Finishes a substep with the speed v' that the joint has at its end.

        at a wall   v_m' = v',   f = H (v_m − v') + τ,   leaves it where f pulls
        free        v_m' = v_m + τ / H,   lead' = lead + Δt (v_m' − v')

    Args:
        params: gap [rad].
        play: before, with H and H v_m + τ of the substep.
        speed: v' [rad/s].
        dt: Δt [s].

    Returns:
        Angle, speed and wall at the end of the substep.

    Source:
        Ours; a wall takes all relative speed: M. Nordin, P.-O. Gutman, Controlling
        Mechanical Systems with Backlash: a Survey, Automatica 38(10), 2002.
    """
    half = 0.5 * params["gap_rad"]
    at_wall = (play.wall != 0.0) | (half <= 0.0)
    pushes = (play.base - play.heavy * speed) * play.wall > 0.0
    begins = play.heavy <= 0.0
    own = play.base / jnp.where(begins, 1.0, play.heavy)
    ahead = jnp.where(at_wall | begins, 0.0, own - speed)
    lead = play.lead + dt * ahead
    hits = ~at_wall & (jnp.abs(lead) >= half) & (lead * ahead > 0.0)
    wall = jnp.where(at_wall, play.wall * pushes, hits * jnp.sign(lead))
    return replace(play, lead=jnp.clip(lead, -half, half), ahead=ahead, wall=wall)


def _encoder(params: Params, play: Play, x: Substep, dt: float):
    """The encoder turns with the motor."""
    play = moved(params, play, x.qd, dt)
    encoder, speed = x.encoder + play.lead, x.encoder_speed + play.ahead
    return play, replace(x, encoder=encoder, encoder_speed=speed)


def _transmission(params: Params, play: Play, x: Substep, dt: float):
    """Passes torque on at a wall, with the momentum of a blow; else frees the link.

    At a wall motor and joint turn as one: I (v' − v) = J (v_m − v) + Δt (τ + …).
    """
    own = params["motor_inertia_kgm2"]
    heavy = own / dt + params["damped"] * x.damping
    play = replace(play, heavy=heavy, base=heavy * (x.qd + play.ahead) + x.torque)
    free = (play.wall == 0.0) & (params["gap_rad"] > 0.0)
    return play, replace(
        x,
        torque=jnp.where(free, 0.0, x.torque + heavy * play.ahead),
        damping=jnp.where(free, 0.0, x.damping),
        inertia=x.inertia - jnp.where(free, own, 0.0),
    )


def _rest(params: Params, target, q, dt) -> Play:
    """In the middle of the gap, as fast as the joint."""
    none = jnp.zeros_like(q)
    return Play(none, none, none, none, none)


KIND = EffectKind(
    name=NAME,
    equation="J v̇_m = τ between the walls, q_m − q ∈ [−b/2, b/2]",
    parameters={},
    acts={Stage.ENCODER: _encoder, Stage.TRANSMISSION: _transmission},
    confusable_with={},
    source="M. Nordin, P.-O. Gutman, Controlling Mechanical Systems with Backlash: "
    "a Survey, Automatica 38(10), 2002",
    init=_rest,
)
"""Stands for the catalogue's play in a simulation of one joint."""


def with_motor(
    effects: Mapping[str, Params],
    nuisance: Nuisance,
    inertia: Float[Array, " p #c"],
    driven: bool,
) -> list[tuple[EffectKind, Params]]:
    """Effects as they act in a simulation: a play with J = min(J_rotor, 0.9 μ I).

    A spring has a motor of its own, which cannot be taken off the link twice: beside
    one the play is the catalogue's.

    Args:
        effects: parameters by name, in the order of the chain.
        nuisance: with the rotor J_rotor [kg·m²] and the factor μ of masses.
        inertia: I, of the joint with all that it carries [kg·m²].
        driven: whether the logged effort moves the motor, which no servo damps then;
            else speeds are damped by their mean, as those of the joint are.

    Returns:
        Kinds and parameters for `chain_step`.

    Source:
        Ours; the rotor that `replay.link` has, too.
    """
    most = MOST_ROTOR * nuisance.mass[None, :] * inertia
    own = jnp.minimum(nuisance.rotor[None, :], most)
    damped = jnp.asarray(0.5 * (1.0 - float(driven)))
    more = {"motor_inertia_kgm2": own, "damped": damped}
    return [
        (KIND, {**p, **more}) if n == NAME and SPRING not in effects else (KINDS[n], p)
        for n, p in effects.items()
    ]


def begun(
    states: tuple[Any, ...],
    anew: Bool[Array, " p #c"],
    read: Float[Array, " p #c"],
    speeds: tuple[Float[Array, " p c"], Float[Array, " p c"]],
) -> tuple[tuple[Any, ...], Float[Array, " p c"]]:
    """Where a simulation begins anew: between the walls the motor is as fast as read.

    Its encoder does not show the speed of the link then, which keeps its own. At a wall
    both change theirs, and with them the momentum H v_m.

    Args:
        states: of the chain.
        anew: where it begins.
        read: speed of the encoder [rad/s].
        speeds: of the link, before it was put to what was read, and then [rad/s].

    Returns:
        States, and the speed of the link [rad/s].

    Source:
        Ours.
    """
    before, speed = speeds
    made = []
    for state in states:
        if isinstance(state, Play):
            free = anew & (state.wall == 0.0) & (state.heavy > 0.0)
            speed = jnp.where(free, before, speed)
            base = state.base + jnp.where(anew, state.heavy * (speed - before), 0.0)
            base = jnp.where(free, state.heavy * read, base)
            state = replace(state, base=base)
        made.append(state)
    return tuple(made), speed
