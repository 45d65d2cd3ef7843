"""Play between motor, whose angle the encoder measures, and joint."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _encoder(params: Params, lead, x, dt):
    """The motor stands `lead` before the joint."""
    return lead, x.replace(encoder=x.encoder + lead)


def _transmission(params: Params, lead, x, dt):
    """Moves the motor inside the gap and passes torque on where it touches.

    Off the walls the motor meets no load and follows kp (c − q_m) = kd q̇_m, as if
    it had no inertia. A wall transmits a torque that pushes it and no torque that
    leaves it.
    """
    half = 0.5 * params["gap_rad"]
    touches_up, touches_down = lead >= half, lead <= -half
    up = jnp.where(touches_up, jnp.maximum(x.torque, 0.0), 0.0)
    down = jnp.where(touches_down, jnp.minimum(x.torque, 0.0), 0.0)
    follow = -jnp.expm1(-x.kp / jnp.maximum(x.kd, 1e-12) * dt)
    moved = lead + follow * x.error - dt * x.qd
    torque = up + down
    damping = jnp.where(torque == 0.0, 0.0, x.damping)
    return jnp.clip(moved, -half, half), x.replace(torque=torque, damping=damping)


EFFECT = EffectKind(
    name="backlash",
    equation="q_m − q ∈ [−b/2, b/2]; torque passes only at the walls",
    parameters={
        "gap_rad": Parameter("rad", 0.0, 0.3, lognormal(0.015, 2.5), identity=0.0)
    },
    acts={Stage.ENCODER: _encoder, Stage.TRANSMISSION: _transmission},
    confusable_with={
        "deadband": "pull from outside with the deadband off",
        "hysteresis": "small loops: play has sharp corners",
        "compliance": "load both ways: play does not grow with load",
        "coulomb_friction": "motor torque while the joint is pulled through the gap",
        "command_quantization": "slow ramp without reversal: backlash leaves no stairs",
        "stribeck_friction": "ramps without reversal",
    },
    source="M. Nordin, P.-O. Gutman, Controlling Mechanical Systems with Backlash: "
    "a Survey, Automatica 38(10), 2002",
    init=lambda params, target, q, dt: jnp.zeros_like(q),
)
