"""What other joints do, seen from readings that are late.

A sensor that is late shows the joint of some time ago, with its own target and torque
of then. All else is read in time: what other joints pushed, how they had turned the
masses, what they took from the supply. So for a candidate with an age L of its
readings, whose clock drifts by d,

    b(t) = b_measured(t − L − d t)

and the posture in which that was measured is the joint's own of then, too: masses turn
on from there.
"""

from dataclasses import replace

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from sysid.diagnosis.replay.acting import Params
from sysid.diagnosis.replay.motion import Motion

BESIDE = (
    *("push", "ext", "inertia", "moment", "axis"),
    *("payload_moment", "payload_shift", "payload_inertia", "payload_push"),
    *("others_nm", "other_q", "other_nm"),
)
"""Fields of the motion that are not read by the joint's own sensor."""

LATE = (("sensor_latency", "latency_s"), ("clock_drift", "drift_ppm"))
"""Age of the readings and drift of their clock, by effect."""


def ages(params: Params, dt: float) -> Float[Array, "2 c"]:
    """Age L of the readings of candidates [steps], and its growth d per step [1].

    Args:
        params: values of the parameters by effect; effects may be missing.
        dt: step of the grid [s].
    """
    none = {"latency_s": 0.0, "drift_ppm": 0.0}
    count = next(x for v in params.values() for x in v.values()).shape[0]
    late, drift = (
        jnp.broadcast_to(params.get(effect, none)[name], count) for effect, name in LATE
    )
    return jnp.stack([late / dt, 1e-6 * drift])


def beside(
    motion: Motion,
    now: Motion,
    steps: Float[Array, " w"],
    age: Float[Array, "2 c"] | None,
) -> tuple[Motion, Float[Array, " wp #c"]]:
    """Reads at one step what other joints did; on straight lines between steps.

    Args:
        motion: at all steps.
        now: the same at the step, with a last axis for the candidates; windows side by
            side.
        steps: number t of the step, in every window.
        age: of the readings of every candidate, see `ages`; None where none is late.

    Returns:
        The motion at the step, and how far the joint has turned since then [rad].

    Source:
        Ours.
    """
    if age is None:
        return now, jnp.zeros_like(now.pos)
    place = steps[:, None] * (1.0 - age[1]) - age[0]
    fields = {name: getattr(motion, name) for name in ("pos", *BESIDE)}
    same = {name: getattr(now, name) for name in fields}
    shape = jax.eval_shape(lambda: _read(fields, place))

    def wide():
        return jax.tree.map(lambda v, s: jnp.broadcast_to(v, s.shape), same, shape)

    # It takes time, and hardly any candidate is late.
    there = jax.lax.cond(jnp.any(age != 0.0), lambda: _read(fields, place), wide)
    turned = now.pos - there.pop("pos")
    return replace(now, **there), turned


def _read(fields: dict[str, Array], place: Float[Array, "w c"]) -> dict[str, Array]:
    """Reads fields (t, p, …) at places: (w p, c, …)."""
    last = len(fields["pos"]) - 1.0
    place = jnp.clip(place, 0.0, last)
    low = jnp.clip(jnp.floor(place), 0.0, max(last - 1.0, 0.0)).astype(jnp.int32)
    part = place - low

    def read(v):
        share = part.reshape(*part.shape, *[1] * (v.ndim - 1))
        found = (1.0 - share) * v[low] + share * v[low + 1]
        found = jnp.swapaxes(found, 1, 2)
        return found.reshape(-1, *found.shape[2:])

    return {name: read(v) for name, v in fields.items()}
