"""Friction that springs back on small motions: a loop that does not know speed."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _deflected(z, x, dt, reach):
    """Deflection z after a substep at the present speed, exactly; never beyond 1."""
    way = jnp.sign(x.qd)
    return way + (z - way) * jnp.exp(-jnp.abs(x.qd) * dt / reach)


def _act(params: Params, z, x, dt):
    """Deflects by the motion of the last substep and predicts that of this one.

    Passive: F d z² / 2 is stored, and of the power F z q̇ that the joint gives the part
    F z² |q̇| is lost. The damping makes the prediction implicit in the speed: the spring
    of this slope, and the friction F z² that stops a joint and never turns it round.
    """
    limit, reach = params["torque_nm"], params["range_rad"]
    z = _deflected(z, x, dt, reach)
    coming = _deflected(z, x, dt, reach)
    along = jnp.sign(x.qd) * coming
    speed = jnp.where(x.qd == 0.0, 1.0, jnp.abs(x.qd))
    spring = limit / reach * (1.0 - along) * dt
    brake = limit * jnp.maximum(along, 0.0) ** 2 / speed
    return z, x.replace(
        passive=x.passive - limit * coming,
        damping=x.damping + spring + brake,
    )


EFFECT = EffectKind(
    name="hysteresis",
    equation="τ_h = −F z, ż = (q̇ − |q̇| z) / d (Dahl)",
    parameters={
        "torque_nm": Parameter("N·m", 0.0, 10.0, lognormal(0.02, 3.0), identity=0.0),
        "range_rad": Parameter("rad", 1e-4, 1.0, lognormal(0.02, 3.0)),
    },
    acts={Stage.FRICTION: _act},
    confusable_with={
        "coulomb_friction": "motions smaller than the presliding range",
        "backlash": "small loops: play has sharp corners",
        "deadband": "small loops: a deadband does not spring back",
        "compliance": "load and unload: a spring leaves no loop",
        "stribeck_friction": "motions smaller than the presliding range",
    },
    source="P. Dahl, Solid Friction Damping of Mechanical Vibrations, AIAA Journal "
    "14(12), 1976",
    init=lambda params, target, q, dt: jnp.zeros_like(q),
)
