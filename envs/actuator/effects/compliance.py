"""A spring between motor, whose angle the encoder measures, and joint.

It is damped as metal and gears are. A servo that follows its target damps it as well,
but at the limit of its torque it does not, and there a spring alone would ring on.
"""

import flax.struct
import jax.numpy as jnp
from jaxtyping import Array, Float

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal

DAMPING = 0.1
"""ζ, damping ratio of a spring: what metal and gears have. Here it is that of the motor
against a joint that stands, with D = 2 ζ √(J / C)."""


@flax.struct.dataclass
class Spring:
    """Spring and motor after a substep, as far as the joint's speed does not matter.

    Attributes:
        torque: torque of the spring before the substep, less that of its damping [N·m].
        ahead: speed of the motor less that of the joint.
        base, slope: its torque and damping's at the end are base − slope · joint speed.
    """

    torque: Float[Array, "*j"]
    ahead: Float[Array, "*j"]
    base: Float[Array, "*j"]
    slope: Float[Array, "*j"]


def _encoder(params: Params, spring: Spring, x, dt):
    """Finishes the last substep with the joint's speed; returns the motor's angle."""
    lag, inertia = _motor(params, x)
    share = _undamped(lag, inertia, dt)
    passed = spring.base - spring.slope * x.qd
    torque = spring.torque + share * (passed - spring.torque)
    ahead = lag * (torque - spring.torque) / dt
    encoder, speed = x.encoder + lag * torque, x.encoder_speed + ahead
    spring = spring.replace(torque=torque, ahead=ahead)
    return spring, x.replace(encoder=encoder, encoder_speed=speed)


def _motor(params: Params, x):
    """Returns C and J: of the joint's inertia no more than there is."""
    lag, inertia = params["compliance_rad_nm"], params["motor_inertia_kgm2"]
    if x.around.inertia is not None:
        inertia = jnp.minimum(inertia, x.around.inertia)
    return lag, inertia


def _undamped(lag: Array, inertia: Array, dt: float) -> Array:
    """Share of a change of torque that the spring has, 1 / (1 + C D / Δt)."""
    heavy = lag * inertia
    # The slope of a root at zero is infinite.
    root = jnp.sqrt(jnp.where(heavy > 0.0, heavy, 1.0)) * (heavy > 0.0)
    return 1.0 / (1.0 + 2.0 * DAMPING * root / dt)


def _transmission(params: Params, spring: Spring, x, dt):
    """Solves motor and spring implicitly for any speed that the joint will have.

        J (v_m' − v_m) / Δt = τ − s [kp C (f' − f) + kd (v_m' − v_m)] − f' − D u
        v_m' = v' + u,   u = C (f' − f) / Δt,   D = 2 ζ √(J / C)

    for the spring's torque f, with the share s of the gains that the servo follows.
    Of the motor's inertia the joint keeps what the spring is stiff enough to pass on.
    """
    lag, inertia = _motor(params, x)
    lag = lag * _undamped(lag, inertia, dt)
    heavy = inertia / dt + x.damping
    soft = lag * (heavy / dt + x.follows * x.kp)
    base = (x.torque + heavy * (x.qd + spring.ahead) + soft * spring.torque) / (
        1.0 + soft
    )
    slope = heavy / (1.0 + soft)
    return spring.replace(base=base, slope=slope), x.replace(
        torque=base - slope * x.qd,
        damping=x.damping / (1.0 + soft),
        inertia=x.inertia - inertia * soft / (1.0 + soft),
    )


def _rest(params: Params, target, q, dt) -> Spring:
    none = jnp.zeros_like(q)
    return Spring(torque=none, ahead=none, base=none, slope=none)


EFFECT = EffectKind(
    name="compliance",
    equation="τ' = (q_m − q) / C + D (q̇_m − q̇), D = 0.2 √(J / C), J q̈_m = τ − τ'; J is "
    "part of the joint's inertia",
    parameters={
        "compliance_rad_nm": Parameter(
            "rad/(N·m)", 0.0, 10.0, lognormal(0.05, 4.0), identity=0.0
        ),
        "motor_inertia_kgm2": Parameter("kg·m²", 0.0, 0.1, lognormal(3e-4, 3.0)),
    },
    acts={Stage.ENCODER: _encoder, Stage.TRANSMISSION: _transmission},
    confusable_with={
        "stiffness": "chirp past the resonance: a spring turns the phase once more",
        "backlash": "load both ways: play does not grow with load",
        "hysteresis": "load and unload: a spring leaves no loop",
        "armature": "chirp past the resonance",
        "joint_coupling": "the joint alone: the spring remains",
    },
    source="A. De Luca, W. Book, Robots with Flexible Elements, Springer Handbook of "
    "Robotics, 2008, ch. 13 (elastic joints)",
    init=_rest,
)
