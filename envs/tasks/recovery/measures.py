"""What a whole recovery is measured by: righted, how fast, how near the stance."""

import math
from collections.abc import Mapping

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Num, Shaped

from envs.task import UNIT
from envs.tasks.recovery.falls import SIDES
from envs.tasks.recovery.settle import UPRIGHT_TILT_DEG

MAX_TILT_RAD = math.radians(UPRIGHT_TILT_DEG)


def recovery_measures(
    recorded: Mapping[str, Shaped[Array, "T ..."]],
    counts: Bool[Array, " T"],
    dt_s: float,
) -> dict[str, Float[Array, ""]]:
    """Measures of one episode, over all falls and again for each side.

    `righted` is 1 if the detector fired and the hand is still level (tilt < 10°) when
    the episode ends, `time_to_upright_s` the time at which the detector fired, its
    0.5 s included, and `final_joint_error_rad` = Σ_j |q_j − q*_j|/20 at the end. The
    last two of them are NaN where the detector did not fire, the last one also where
    the ramp was not over by the end of the episode. `unit` is the number of the pose:
    episodes from one pose are not independent.

    Args:
        recorded: the signals over the control steps, see `Recovery.scene_signals` in
            `envs.tasks.recovery.task`.
        counts: the steps that count.
        dt_s: control interval [s].

    Source:
        Paper, fall recovery; that the hand must still be level is ours.
    """
    last = jnp.argmax(jnp.cumsum(counts))
    fired = (recorded["settling"] > 0) & counts
    done = jnp.any(fired)
    settled = done & (recorded["settled"][last] > 0)
    error, tilt = recorded["joint_error_rad"][last], recorded["tilt_rad_v"][last]
    found = {
        "righted": (done & (tilt < MAX_TILT_RAD)).astype(jnp.float32),
        "time_to_upright_s": jnp.where(done, jnp.argmax(fired) * dt_s, jnp.nan),
        "final_joint_error_rad": jnp.where(settled, error, jnp.nan),
    }
    pose = recorded["fall_pose"][0].astype(jnp.float32)
    return found | _per_side(found, recorded["fall_side"][0]) | {UNIT: pose}


def _per_side(
    found: Mapping[str, Float[Array, ""]], side: Num[Array, ""]
) -> dict[str, Float[Array, ""]]:
    """The same again under the name of the side, NaN for falls on the other."""
    return {
        f"{name}_{which}": jnp.where(side == index, value, jnp.nan)
        for index, which in enumerate(SIDES)
        for name, value in found.items()
    }
