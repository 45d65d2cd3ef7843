"""Equation-error residuals of many candidates along the measured motion.

Instead of simulating the joint, the actuator chain is evaluated at the angles that were
measured. Every candidate has two residuals, both in N·m:

    controller:  measured effort − torque of the servo at target and measured angle
    mechanics:   torque behind the gears + load − (I + J) q̈ − b q̇ − friction

where the effort was logged it is also what enters the gears, so each residual is
independent of errors in the other part; without it the servo's own torque enters.
Nothing is integrated, so nothing drifts, sticks wrongly or needs an initial state.

Candidates differ in numbers only: every effect of the catalogue is present, those that
a candidate does not have at their identity. One compilation serves all of them; two
more leave out what takes half of the time and hardly any candidate has.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from envs.actuator.chain import JointInput, chain_step, init_states
from envs.actuator.effect import Substep
from sysid.diagnosis.replay import cascade, link
from sysid.diagnosis.replay.band import band, smooth
from sysid.diagnosis.replay.beside import beside
from sysid.diagnosis.replay.command import commands_of
from sysid.diagnosis.replay.model import (
    Candidates,
    Nuisance,
    Row,
    at_step,
    make_candidates,
    rows_of,
)
from sysid.diagnosis.replay.motion import Track, motion_of
from sysid.diagnosis.replay.noise import residual_noise
from sysid.diagnosis.replay.surroundings import surroundings_at
from sysid.diagnosis.replay.torque_slope import SLOPE

LEAST_INERTIA = 0.01
"""Least share of the model's inertia. Light masses and a lighter rotor may each be
plausible, but less than nothing together: behind a spring that runs away."""


@flax.struct.dataclass
class Carry:
    """What a step leaves to the next.

    Attributes:
        states: of the effects.
        q: joint angle [rad].
        encoder: modelled reading at that angle [rad].
        slope: change of the reading with the angle, ∂y/∂q [1].
        link: angle [rad] and speed [rad/s] of the link less the motor's.
    """

    states: tuple[Any, ...]
    q: Float[Array, "p c"]
    encoder: Float[Array, "p c"]
    slope: Float[Array, "p c"]
    link: link.State


@flax.struct.dataclass
class Torques:
    """Terms of both residuals before their band, in units of the nominal noise.

    Attributes:
        command: torque of the servo without its answer to angle and speed, in the unit
            of the logged effort [N·m].
        answer: that answer [N·m].
        controller_gain: noise gain of the controller's residual [1].
        needed: torque that the motion lacks, without friction, over the noise gain.
        loose: torque of a link in its play, before smoothing, over the same.
        enters: share of the servo's torque that enters the gears, over the same.
        friction, viscous: friction [N·m] and [N·m·s/rad], over the same.
    """

    command: Float[Array, "*t p c"]
    answer: Float[Array, "*t p c"]
    controller_gain: Float[Array, "*t p c"]
    needed: Float[Array, "*t p c"]
    loose: Float[Array, "*t p c"]
    enters: Float[Array, "*t p c"]
    friction: Float[Array, "*t p c"]
    viscous: Float[Array, "*t p c"]


@partial(jax.jit, static_argnames=("dt", "names"))
def equation_error(
    track: Track,
    paths: Float[Array, "c k t p"],
    values: tuple[dict[str, dict[str, Float[Array, " c"]]], Nuisance],
    friction_speed: Float[Array, ""],
    dt: float,
    names: tuple[str, ...],
) -> Float[Array, "2 m p c"]:
    """Residuals e = G (left side − right side) / A of candidates c.

    G is the Gaussian band, A the noise gain, and the sides are those of the servo's
    law and of the equation of motion:

        controller  τ_log = (kp (c − y) − kd ẏ) / g
        mechanics   τ_gears + τ_load = (μ I + J) q̈ + b q̇ + F sign q̇

    Where a joint may be at rest, its friction is whatever balances it: those samples
    of the mechanics must not count. Near them friction reverses within the band.

    Angles are noisy themselves, so both residuals are divided by the noise that a
    candidate would have, relative to the nominal simulation: otherwise the fit would
    lower gains to reduce the noise that they amplify.

    Args:
        track: the measured motion.
        paths: what the servo follows, see `commands_of` [rad].
        values: of the parameters of the effects by name, in their units, and of the
            other parameters.
        friction_speed: speed below which a joint may be at rest [rad/s].
        dt: step of the grid [s].
        names: effects in the order of the chain. Without those of a link and of late
            readings no candidate may have any, and it takes half the time.

    Returns:
        Controller and mechanics [N·m] at every `EVERY`-th step.

    Source:
        Equation-error (inverse dynamic) identification: M. Gautier and W. Khalil,
        Exciting trajectories for the identification of base inertial parameters of
        robots, 1992. The division by A is ours.
    """
    candidates = make_candidates(track, *values, dt, names)
    rows = rows_of(track, commands_of(paths), dt)
    start = _start(candidates, jax.tree.map(lambda v: v[0], rows))
    step = partial(_step, candidates, friction_speed)
    torques = jax.lax.scan(step, start, rows)[1]
    return _residuals(torques, track, friction_speed)


def _start(candidates: Candidates, row: Row) -> Carry:
    """At rest at the first measured angle."""
    row = at_step(row)
    pos, count = row.motion.pos, candidates.gap_rad.shape[1]
    q = jnp.broadcast_to(pos, (*pos.shape[:1], count))
    none = jnp.zeros_like(q)
    read = q + candidates.nuisance.skew_s * row.motion.vel
    chain = candidates.chain(row)
    states = init_states(chain, row.command, q, candidates.dt)
    return Carry(states, read, read, none + 1.0, (none, none))


def _step(
    candidates: Candidates, friction_speed: Float[Array, ""], carry: Carry, row: Row
) -> tuple[Carry, Torques]:
    """Evaluates the chain at one step: servo, transmission, friction, noise."""
    row, nuisance, track = at_step(row), candidates.nuisance, candidates.track
    dt, number = candidates.dt, row.number[None]
    now, turned = beside(motion_of(track), row.motion, number, candidates.age)
    angle, rate = candidates.reading(now)
    # The angle at which the encoder would read this: a step of Newton's method.
    q = carry.q + (angle - carry.encoder) / carry.slope
    qd = rate / carry.slope
    away = q - angle + carry.link[0] + turned
    around, load = surroundings_at(track, now, away, nuisance.mass, nuisance.push_gain)
    kp, kd = track.kp[:, None], track.kd[:, None]
    joint = JointInput(row.command, q, qd, load, kp, kd, around)
    states, x = chain_step(candidates.chain(row), carry.states, joint, dt)
    inertia = nuisance.mass * now.inertia + x.inertia
    inertia = jnp.maximum(inertia, LEAST_INERTIA * now.inertia)
    gain = nuisance.effort_gain
    ramp = candidates.state_of(SLOPE.name)
    x = replace(x, follows=jnp.maximum(x.follows, states[ramp][1] if ramp else 0.0))
    way = _direction(now.slow_vel, friction_speed)
    passes = candidates.passes(x, way)
    noise, nominal = residual_noise(track, now, x, passes, gain, inertia / carry.slope)
    encoder, slope = _encoder_slope(states[-2], qd, carry.slope)
    # y = f(q), ÿ = f' q̈ + ḟ' q̇
    acc = now.acc + (nuisance.skew_s + nuisance.hold_s) * now.jerk
    acc = (acc - (slope - carry.slope) / dt * qd) / slope
    step = _JointStep(x, inertia, acc, row.snap, slope, now.slow_vel)
    behind, needed, loose = _transmission(candidates, step, friction_speed, carry.link)
    taken = x.torque + x.viscous * now.slow_vel + x.friction * way - needed - loose
    states = _integral(candidates, carry.states, states, x, taken)
    unit = gain * candidates.spring_gain * noise.mechanics / nominal.mechanics
    servo, (sharp_angle, sharp_rate) = states[-1], candidates.sharp_reading(now)
    enters = (1.0 - track.measured[:, None]) / unit
    # What the logged effort has of the ripple the mechanics does not add.
    shown = track.measured[:, None] * (1.0 - nuisance.ripple) * row.ripple
    command = servo + x.kp * (sharp_angle + x.follows * shown) + x.kd * sharp_rate
    torques = Torques(
        command=command / gain,
        answer=(x.kp * angle + x.kd * rate) / gain,
        controller_gain=noise.controller / nominal.controller,
        needed=needed / unit - enters * servo,
        loose=loose / unit,
        enters=gain * enters,
        friction=x.friction / unit,
        viscous=x.viscous / unit,
    )
    return Carry(states, q, encoder, slope, behind), torques


def _integral(candidates: Candidates, before, states, x, taken):
    """Lets the integral of a cascade follow what the motion takes.

    Where the effort was logged it has followed that, and at a limit nothing.
    """
    at = candidates.state_of(cascade.NAME)
    if not at:
        return states
    rate = cascade.rate_of(candidates.effects[cascade.NAME], x)
    known = (candidates.track.measured[:, None] > 0.0) | (x.follows <= 0.0)
    begun = cascade.answered(before[at], states[at].servo)
    followed = cascade.follow(begun, taken, rate, candidates.dt)
    mixed = jax.tree.map(lambda a, b: jnp.where(known, a, b), states[at], followed)
    return (*states[:at], mixed, *states[at + 1 :])


def _encoder_slope(modelled, qd, last):
    """Returns the modelled reading and its slope ẏ / q̇; the last one at rest.

    What encoders make of angles is as steep for speeds and accelerations.
    """
    encoder, speed = modelled
    moves = jnp.abs(qd) > 1e-6
    ratio = speed / (qd + 1.0 * ~moves)
    return encoder, ratio * moves + last * ~moves


@dataclass(frozen=True, eq=False)
class _JointStep:
    """The joint at one step: signals, inertia, motion and the encoder's slope."""

    x: Substep
    inertia: Float[Array, "p c"]
    acc: Float[Array, "p c"]
    snap: Float[Array, "p 1"]
    slope: Float[Array, "p c"]
    slow_vel: Float[Array, "p 1"]


def _transmission(
    candidates: Candidates, step: _JointStep, friction_speed, state: link.State
):
    """Advances the link behind the motor.

    Returns:
        Its state, and the torque that the motion lacks [N·m]: of the motion as it was
        smoothed, and what is still to be smoothed.
    """
    x, inertia, acc = step.x, step.inertia, step.acc
    own = jnp.minimum(candidates.nuisance.rotor, link.MOST_ROTOR * inertia)
    force = x.passive + x.load - (inertia - own) * acc
    outer = inertia - own
    sharp = force + outer * candidates.smoothing_s2 * step.snap / step.slope
    way = _direction(step.slow_vel, friction_speed)
    bears = x.passive + x.load - x.viscous * step.slow_vel - x.friction * way
    together = (own * bears - outer * x.torque) / inertia
    forces = link.LinkForce(force, sharp, together)
    if candidates.linked:
        behind = link.Link(outer, candidates.gap_rad, candidates.compliance)
        state, pull = link.link_step(state, forces, behind, candidates.dt)
    else:
        state, pull = link.rigid_step(state, forces)
    return state, x.torque - own * acc + pull.smoothed, pull.sharp


def _direction(vel, friction_speed):
    """Direction of dry friction in [−1, 1]: it turns over within the speeds of rest."""
    return jnp.clip(vel / friction_speed, -1.0, 1.0)


def _residuals(
    torques: Torques, track: Track, friction_speed
) -> Float[Array, "2 m p c"]:
    """Passes the terms through the band and subtracts friction.

    The servo's torque is smoothed as the measured one was; its answer to angle and
    speed was smoothed with them.
    """
    vel, effort = track.slow_vel[:, :, None], track.effort[:, :, None]
    way = _direction(vel, friction_speed)
    servo = smooth(torques.command) - torques.answer
    needed = torques.needed - torques.viscous * vel - torques.friction * way
    mechanics = band(needed + smooth(torques.loose) + torques.enters * servo)
    return jnp.stack([band((effort - servo) / torques.controller_gain), mechanics])
