"""Measures of one episode of pushing."""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from rewards.pushing import DELIVERED_M

STAY_M = 0.05
DWELL_S = 1.0
NEAR_M = (0.20, 0.30)
"""Ends of the bands of distance by which deliveries are counted [m]; ours."""


def push_measures(
    error_m: Float[Array, " T"],
    distance_m: Float[Array, " T"],
    counts: Bool[Array, " T"],
    dt_s: float,
) -> dict[str, Float[Array, ""]]:
    """Delivery: within 2 cm of the target, then for 1 s within 5 cm.

    delivered = ∃ t: d_t < 2 cm ∧ d_{t+1} … d_{t+n} < 5 cm, n = 1 s/Δt.

    Args:
        error_m: distance d of the cube from its target [m].
        distance_m: of the target from the cube at the start [m].
        counts: steps before the end of the episode.
        dt_s: control interval Δt [s].

    Returns:
        `delivered` (0 or 1) and the same for targets up to 20 cm, up to 30 cm and
        beyond (NaN for other episodes); `delivery_time_s`, of entering the 2 cm, and
        `final_error_m`, at the end of the 1 s dwell (paper), both NaN without a
        delivery; `last_error_m`, at the episode's end; `target_distance_m`.

    Source:
        Paper, object pushing.
    """
    dwell = round(DWELL_S / dt_s)
    entered = (error_m < DELIVERED_M) & counts
    strayed = ~((error_m < STAY_M) & counts)
    # Steps with a departure within the dwell that follows them.
    departures = jnp.cumsum(strayed)
    padded = jnp.append(departures, jnp.full(dwell, departures[-1] + 1))
    stays = padded[dwell : dwell + len(error_m)] == departures
    done = entered & stays
    delivered, step = jnp.any(done), jnp.argmax(done)
    distance = distance_m[0]
    near, far = distance < NEAR_M[0], distance >= NEAR_M[1]
    last = jnp.maximum(jnp.sum(counts) - 1, 0)

    def where(
        condition: Bool[Array, ""], value: Float[Array, ""] | Bool[Array, ""]
    ) -> Float[Array, ""]:
        return jnp.where(condition, value.astype(jnp.float32), jnp.nan)

    return {
        "delivered": delivered.astype(jnp.float32),
        "delivered_to_20_cm": where(near, delivered),
        "delivered_20_to_30_cm": where(~near & ~far, delivered),
        "delivered_from_30_cm": where(far, delivered),
        "delivery_time_s": where(delivered, (step + 1) * dt_s),
        "final_error_m": where(delivered, error_m[step + dwell]),
        "last_error_m": error_m[last],
        "target_distance_m": distance,
    }
