"""A drive's slope limit between the steps of the grid.

A limit of slope S begins to act, and is met again, within a step. Were it to look at
the ends of steps only, it would act from where a step begins: up to a step too early,
and S would come out as much too small. So it goes through the step by what the servo
asks for at the times `WITHIN`, seen from the end of the step,

    a(t) = a_1 − f (kp (c_1 − c(t)) − kp (y_1 − y(t)) − kd (ẏ_1 − ẏ(t)))

with command c, angle y, and f the share of the gains that the servo follows there.
"""

from dataclasses import replace

import jax.numpy as jnp
from jaxtyping import Array, Float

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.effect import EffectKind, Params, Stage
from sysid.diagnosis.replay.command import WITHIN

NAME = "torque_slope_limit"
"""The effect that acts here."""


def within_steps(
    x: Float[Array, "t p"], rate: Float[Array, "t p"], dt: float
) -> Float[Array, "t k p"]:
    """How far a signal still goes at the times `WITHIN` until a step's end.

    d(u) = x_1 − x(u), with x(u) on the cubic through values and rates of both ends.

    Args:
        x: signal at the ends of the steps [rad], or a derivative of an angle.
        rate: its derivative there, per second.
        dt: step [s].

    Returns:
        d at times u in (0, 1) of the step, in the unit of x.

    Source:
        Textbook Hermite interpolation.
    """
    u = jnp.asarray(WITHIN)[None, :, None]
    last, before = (jnp.concatenate([v[:1], v[:-1]])[:, None] for v in (x, rate))
    by_rates = u * (1.0 - u) * ((1.0 - u) * before - u * rate[:, None]) * dt
    return (x[:, None] - last) * (1.0 - u**2 * (3.0 - 2.0 * u)) - by_rates


def _act(params: Params, state, x, dt):
    """Advances the limited torque through a step.

    A limited torque bears the noise of what was asked for when the limit began to act.
    """
    torque, past = state[0], 0.0
    for k, time in enumerate(WITHIN):
        ahead = x.kp * params["error"][k] - x.kd * params["speed"][k]
        reach = params["slope_nm_s"] * (time - past) * dt
        torque = jnp.clip(x.torque - x.follows * ahead, torque - reach, torque + reach)
        past = time
    reach = params["slope_nm_s"] * (1.0 - past) * dt
    torque = jnp.clip(x.torque, torque - reach, torque + reach)
    meets = torque == x.torque
    bears = jnp.where(meets, 0.0, x.follows)
    follows = jnp.where(meets, x.follows, 0.0)
    return (torque, bears), x.replace(torque=torque, follows=follows)


def _rest(params: Params, target, q, dt):
    return jnp.zeros_like(q), jnp.zeros_like(q)


SLOPE: EffectKind = replace(CATALOGUE[NAME], acts={Stage.TORQUE: _act}, init=_rest)
"""The effect as it acts along a measured motion: with its slope it takes how far
`error` and `speed` still go at the times `WITHIN` [rad], [rad/s]. Its state: the torque
[N·m] and the share of the gains with which a limited torque bears noise."""
