"""Two clocks that run apart: the reading's age grows with time."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, normal
from envs.actuator.effects.transport_delay import MAX_DELAY_S, delay_line, read_delayed


def _act(params: Params, state, x, dt):
    """Reads older and older, or extrapolates further and further.

    An age of `MAX_DELAY_S` is the largest, either way.
    """
    line, elapsed = state
    line = jnp.concatenate([x.reading[None], line[:-1]])
    elapsed = elapsed + dt
    age = jnp.clip(1e-6 * params["drift_ppm"] * elapsed, -MAX_DELAY_S, MAX_DELAY_S)
    late = read_delayed(line, jnp.maximum(age, 0.0), dt)
    early = jnp.maximum(-age, 0.0) * x.encoder_speed
    return (line, elapsed), x.replace(reading=late + early)


EFFECT = EffectKind(
    name="clock_drift",
    equation="y_host(t) = y(t − d t), from the start of the record",
    parameters={
        "drift_ppm": Parameter("1e-6", -2000.0, 2000.0, normal(0.0, 50.0), identity=0.0)
    },
    acts={Stage.READING: _act},
    confusable_with={
        "sensor_latency": "the lag at the beginning and at the end of a long record",
        "transport_delay": "the lag at the beginning and at the end of a long record",
    },
    source="D. Mills, Computer Network Time Synchronization, 2nd ed., CRC 2010 "
    "(frequency errors of quartz clocks)",
    init=lambda params, target, q, dt: (delay_line(q, dt), jnp.zeros_like(q)),
)
