"""A link behind play or a spring, driven by the measured motion of its motor.

The encoder sits on the motor, so the link's angle is not measured. With x, the link's
angle less the motor's, and all that acts on the link in the motor's frame,
F = load − J q̈_m,

    rigid       x = 0
    spring      J ẍ = F − D ẋ − x / C
    play        J ẍ = F between the walls, |x| ≤ b / 2; a wall takes all speed

the motor feels the pull F − J ẍ.
"""

import flax.struct
import jax.numpy as jnp
from jaxtyping import Array, Float

from envs.actuator.effects.compliance import DAMPING
from envs.actuator.trigonometry import sine_cosine

MOST_ROTOR = 0.9
"""Largest share of a joint's inertia that is on the motor's side."""

SIZES = (("backlash", "gap_rad"), ("compliance", "compliance_rad_nm"))
"""Effects that act here, with the parameter that is zero where both move as one."""

EFFECTS = tuple(effect for effect, _ in SIZES)

State = tuple[Float[Array, "p c"], Float[Array, "p c"]]
"""Angle [rad] and speed [rad/s] of the link less the motor's."""


@flax.struct.dataclass
class Link:
    """What connects motor and link.

    Attributes:
        inertia: J, of the link [kg·m²].
        gap_rad: play b; 0 for none [rad].
        compliance: C of the spring; 0 for none. Play goes before it [rad/(N·m)].
    """

    inertia: Float[Array, "p c"]
    gap_rad: Float[Array, "1 c"]
    compliance: Float[Array, "1 c"]


@flax.struct.dataclass
class LinkForce:
    """Torque on the link in the motor's frame, three times [N·m].

    Attributes:
        smoothed: F of the motion as it was smoothed.
        sharp: F of the motion before smoothing.
        together: torque on the link if motor and link moved as one under the motor's.
    """

    smoothed: Float[Array, "p c"]
    sharp: Float[Array, "p c"]
    together: Float[Array, "p c"]


@flax.struct.dataclass
class Pull:
    """Mean pull on the motor during a step [N·m].

    Attributes:
        smoothed: of the motion as it was smoothed.
        sharp: what is still to be smoothed.
    """

    smoothed: Float[Array, "p c"]
    sharp: Float[Array, "p c"]


def link_step(
    state: State, force: LinkForce, link: Link, dt: float
) -> tuple[State, Pull]:
    """Advances the link by a step: J ẍ = F − D ẋ − x / C, or |x| ≤ b / 2.

    A spring passes on the smoothing of the motor's motion. Play does not: a wall's
    blow, smoothed over the time before it, would brake the link on its way.

    Args:
        state: x [rad] and ẋ [rad/s] at the beginning of the step.
        force: F [N·m].
        link: J, b and C.
        dt: step [s].

    Returns:
        The state at its end, and the pull F − J ẍ on the motor [N·m].

    Source:
        Ours; a spring's step is the solution of the damped oscillator for a constant
        torque, and play is a mass between inelastic walls.
    """
    soft = _spring(state, force.smoothed, link, dt)
    free = _play(state, force, link, dt)
    plays = link.gap_rad > 0.0
    angle, rate = (
        jnp.where(plays, a, jnp.where(link.compliance > 0.0, b, 0.0))
        for a, b in zip(free, soft, strict=True)
    )
    lost = link.inertia * (rate - state[1]) / dt
    pull = Pull(smoothed=force.smoothed - lost * ~plays, sharp=-lost * plays)
    return (angle, rate), pull


def rigid_step(state: State, force: LinkForce) -> tuple[State, Pull]:
    """`link_step` without play and spring, b = C = 0: in a third of the time of both.

    Args:
        state: x = 0 [rad] and ẋ = 0 [rad/s].
        force: F [N·m].

    Returns:
        The same state, and the pull F on the motor [N·m].

    Source:
        Ours.
    """
    return state, Pull(smoothed=force.smoothed, sharp=jnp.zeros_like(force.smoothed))


def _play(state: State, force: LinkForce, link: Link, dt: float) -> State:
    """Flies freely, stops at a wall, and rests there while the motor pushes it.

    The motor's torque decides whether it pushes: the noise of its acceleration would
    throw the link off, by about as much as angles are noisy. Angles belong to the steps
    of the grid and speeds to the middles between them, else a flight of n steps would
    go 1 + 1/n times as far. The last speed before a wall is the one that ends there.
    """
    (x, speed), half = state, 0.5 * link.gap_rad
    place = jnp.clip(x + speed * dt, -half, half)
    rests = (jnp.abs(place) >= half) & (force.together * place > 0.0)
    ahead = (speed + force.sharp / link.inertia * dt) * ~rests
    return place, jnp.clip(ahead, (-half - place) / dt, (half - place) / dt)


def _spring(state: State, force: Float[Array, "p c"], link: Link, dt: float) -> State:
    """Oscillates about its equilibrium under the force: exact for a constant one."""
    x, speed = state
    lag = jnp.maximum(link.compliance, 1e-9)
    omega = jnp.sqrt(1.0 / (lag * link.inertia))
    away = x - force * lag
    turn = jnp.sqrt(1.0 - DAMPING**2) * omega
    fade = jnp.exp(-DAMPING * omega * dt)
    sine, cosine = sine_cosine(turn * dt)
    sine = sine / turn
    lead = speed + DAMPING * omega * away
    pull = omega**2 * away + DAMPING * omega * speed
    return (
        force * lag + fade * (away * cosine + lead * sine),
        fade * (speed * cosine - pull * sine),
    )
