"""Age of the angles that reach the host; the servo's own loop is not affected."""

import jax.numpy as jnp

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal
from envs.actuator.effects.transport_delay import MAX_DELAY_S, delay_line, read_delayed


def _act(params: Params, line, x, dt):
    line = jnp.concatenate([x.reading[None], line[:-1]])
    return line, x.replace(reading=read_delayed(line, params["latency_s"], dt))


EFFECT = EffectKind(
    name="sensor_latency",
    equation="y_host(t) = y(t − T)",
    parameters={
        "latency_s": Parameter(
            "s", 0.0, MAX_DELAY_S, lognormal(0.005, 2.5), identity=0.0
        )
    },
    acts={Stage.READING: _act},
    confusable_with={
        "transport_delay": "effort against position, or an external event",
        "clock_drift": "the lag at the beginning and at the end of a long record",
    },
    source="S. Tan et al., Sim-to-Real: Learning Agile Locomotion for Quadruped "
    "Robots, RSS 2018",
    init=lambda params, target, q, dt: delay_line(q, dt),
)
