"""Transport delay of the target: bus, driver and firmware queues."""

import math

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal

MAX_DELAY_S = 0.1


def delay_line(rest: Float[Array, "*j"], dt: float) -> Float[Array, " slots *j"]:
    """A line at rest, newest sample first: u_k = rest, k = 0 … ⌈MAX_DELAY_S / Δt⌉.

    Args:
        rest: target that has been sent since t = −∞ [rad].
        dt: substep Δt [s].

    Source:
        Ours: the length is fixed, so that the delay may be traced.
    """
    slots = math.ceil(round(MAX_DELAY_S / dt, 6)) + 1
    return jnp.broadcast_to(rest, (slots, *jnp.shape(rest)))


def read_delayed(
    line: Float[Array, " slots *j"], delay_s: Float[ArrayLike, "*#j"], dt: float
) -> Float[Array, "*j"]:
    """Reads the line at a fractional age a = T / Δt: Σ_k max(0, 1 − |k − a|) u_k [rad].

    Linear between the two samples around it, hence exact on ramps.

    Args:
        line: samples u_k, newest first [rad].
        delay_s: T [s], clipped to what the line holds.
        dt: substep Δt [s].

    Source:
        T. Laakso et al., Splitting the Unit Delay, IEEE Signal Processing Magazine
        13(1), 1996 (linear interpolation).
    """
    age = jnp.clip(delay_s / dt, 0.0, line.shape[0] - 1.0)
    age = jnp.broadcast_to(age, line.shape[1:])
    ages = jnp.arange(line.shape[0]).reshape(-1, *[1] * age.ndim)
    weights = jnp.maximum(0.0, 1.0 - jnp.abs(ages - age))
    return jnp.sum(weights * line, axis=0)


def _act(params: Params, line, x, dt):
    line = jnp.concatenate([x.command[None], line[:-1]])
    return line, x.replace(command=read_delayed(line, params["delay_s"], dt))


EFFECT = EffectKind(
    name="transport_delay",
    equation="c(t) = u(t − T)",
    parameters={
        "delay_s": Parameter("s", 0.0, MAX_DELAY_S, lognormal(0.01, 2.0), identity=0.0)
    },
    acts={Stage.COMMAND: _act},
    confusable_with={
        "lowpass_cutoff": "steps: dead time before any motion; chirp: gain stays flat",
        "acceleration_limit": "steps of two sizes: the lag of a limit grows with the "
        "size",
        "slew_limit": "steps of two sizes: the lag of a limit grows with the size",
        "sensor_latency": "an event seen by another clock, e.g. a hit",
        "armature": "chirp: inertia bends the gain",
        "damping": "chirp near resonance: damping lowers the peak",
        "torque_slope_limit": "steps of two sizes, in the effort: ramps of one slope",
        "clock_drift": "the lag at the beginning and at the end of a long record",
    },
    source="Paper, Table I (closed-loop delay 19 ms)",
    init=lambda params, target, q, dt: delay_line(target, dt),
)
