"""A link behind play or a spring, led by the measured motion of its motor.

The encoder sits on the motor, so the link's angle is not measured. With x, the link's
angle less the motor's, and all that acts on the link in the motor's frame,
F = load − J q̈_m,

    rigid       x = 0
    spring      J ẍ = F − D ẋ − x / C
    play        J ẍ = F between the walls, |x| ≤ b / 2; a wall takes all speed

the motor feels the pull F − J ẍ.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

DAMPING = 0.1
"""Damping ratio of a spring: what metal and gears have."""

MOST_ROTOR = 0.9
"""Largest share of a joint's inertia that is on the motor's side."""

POINTS = 64
"""Number of frequencies over which noise is averaged."""

EFFECTS = ("backlash", "compliance")
"""Effects that act here."""

State = tuple[Float[Array, "p c"], Float[Array, "p c"]]
"""Angle [rad] and speed [rad/s] of the link less the motor's."""


def spring_noise(
    inertia: Float[Array, "p c"],
    rotor: Float[Array, "p c"],
    compliance: Float[Array, "1 c"],
    angle: Float[Array, ""],
    effort: Float[Array, ""],
    step_s: float,
) -> Float[Array, "p c"]:
    """Returns how much louder a spring makes the needed torque than a rigid link.

    What is noise in the motor's angle shakes the link at its own frequency. Without
    this the fit would give the motor more of the inertia, and the spring less to shake.

        A² = mean_ω (|J_m + J H|² ω⁴ s² + e²) / ((J_m + J)² ω⁴ s² + e²)

    with H = 1 / (1 − ω² J C + 2 i ζ ω √(J C)); a residual is white up to half its rate.

    Args:
        inertia: J, of the link [kg·m²].
        rotor: J_m, on the motor's side [kg·m²].
        compliance: C; 0 for none [rad/(N·m)].
        angle: s, noise of the angle [rad].
        effort: e, noise of the effort in the same band [N·m].
        step_s: time between samples of the residual [s].
    """
    omega = jnp.pi / step_s * (jnp.arange(POINTS) + 0.5)[:, None, None] / POINTS
    shakes = omega**2 * jnp.maximum(angle, 1e-12)
    lag = omega * jnp.sqrt(inertia * compliance)
    link = inertia / (1.0 - lag**2 + 2.0j * DAMPING * lag)
    soft = (jnp.abs(rotor + link) * shakes) ** 2 + effort**2
    rigid = ((rotor + inertia) * shakes) ** 2 + effort**2
    return jnp.where(compliance > 0.0, jnp.sqrt(jnp.mean(soft / rigid, 0)), 1.0)


def link_step(
    state: State,
    force: Float[Array, "p c"],
    sharp: Float[Array, "p c"],
    touch: Float[Array, "p c"],
    inertia: Float[Array, "p c"],
    gap_rad: Float[Array, "p c"],
    compliance: Float[Array, "p c"],
    dt: float,
) -> tuple[State, Float[Array, "p c"], Float[Array, "p c"]]:
    """Advances the link by a step.

    A spring passes on what smoothing did to the motor's motion. Play does not: a
    wall's blow, smoothed over the time before it, would brake the link on its way.

    Args:
        state: at the beginning of the step.
        force: F, of the motion as it was smoothed [N·m].
        sharp: F, of the motion before [N·m].
        touch: F, if motor and link moved as one under the motor's torque [N·m].
        inertia: of the link, J [kg·m²].
        gap_rad: play b; 0 for none.
        compliance: C of the spring [rad/(N·m)]; 0 for none. Play goes before it.
        dt: step [s].

    Returns:
        The state at its end, and the mean pull on the motor during it [N·m]: of the
        motion as it was smoothed, and what is still to be smoothed.
    """
    x, speed = state
    soft = _spring(x, speed, force, inertia, compliance, dt)
    loose = _play(x, speed, sharp, touch, inertia, 0.5 * gap_rad, dt)
    angle, rate = (
        jnp.where(gap_rad > 0.0, a, jnp.where(compliance > 0.0, b, 0.0))
        for a, b in zip(loose, soft, strict=True)
    )
    lost = inertia * (rate - speed) / dt
    plays = gap_rad > 0.0
    return (angle, rate), force - lost * ~plays, -lost * plays


def _play(x, speed, sharp, touch, inertia, half, dt) -> State:
    """Flies freely, stops at a wall, and rests there while the motor pushes it.

    The motor's torque tells whether it pushes: the noise of its acceleration would
    throw the link off, by about as much as angles are noisy. Angles belong to the steps
    of the grid and speeds to the middles between them, else a flight of n steps would
    go 1 + 1/n times as far. The last speed before a wall is the one that ends there.
    """
    place = jnp.clip(x + speed * dt, -half, half)
    rests = (jnp.abs(place) >= half) & (touch * place > 0.0)
    ahead = (speed + sharp / inertia * dt) * ~rests
    return place, jnp.clip(ahead, (-half - place) / dt, (half - place) / dt)


def _spring(x, speed, force, inertia, compliance, dt) -> State:
    """Swings about where the force holds it: exact for an even force."""
    lag = jnp.maximum(compliance, 1e-9)
    omega = jnp.sqrt(1.0 / (lag * inertia))
    away = x - force * lag
    turn = jnp.sqrt(1.0 - DAMPING**2) * omega
    fade = jnp.exp(-DAMPING * omega * dt)
    cosine, sine = jnp.cos(turn * dt), jnp.sin(turn * dt) / turn
    lead = speed + DAMPING * omega * away
    pull = omega**2 * away + DAMPING * omega * speed
    return (
        force * lag + fade * (away * cosine + lead * sine),
        fade * (speed * cosine - pull * sine),
    )
