"""Measures of an episode of keyboard pressing, from its recorded signals."""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Shaped

from envs.tasks.keyboard.model import KEY_NAMES
from rewards.gates import FORCE_THRESHOLD_N, in_contact


def press_measures(
    recorded: Mapping[str, Shaped[Array, "T ..."]], counts: Bool[Array, " T"]
) -> dict[str, Float[Array, ""]]:
    """What became of the requests of an episode, and how the hand stood meanwhile.

    `correct_fraction` = hits/(hits + wrong + timeouts); a request that the end of the
    episode cuts off is not decided. Latencies are those of the hits, from the control
    step in which the request is first seen to the end of the one in which the key
    closes (paper: command issue to recorded outcome). `wrong_<key>` counts requests
    that this key decided wrongly. `stance_drift_mm` is the mean distance of the
    supporting tips at the end from where they stood half a second into the episode, and
    `least_support_fraction` the share of the steps in which the supporting finger that
    stands least has contact: near 0 if one hangs in the air, whatever its drift.

    Args:
        recorded: signals over T steps, see `Keyboard.scene_signals` in
            `envs.tasks.keyboard.task`.
        counts: the steps that count.

    Returns:
        Fractions and counts [1], latencies [s], tilt [°], drift [mm]; NaN where nothing
        was decided, and for supports where no step counts.

    Source:
        Paper, keyboard pressing; stray presses, drift and supports are ours.
    """
    hit, wrong, timeout, stray = (
        recorded[name] * counts for name in ("hit", "wrong", "timeout", "stray")
    )
    decided = jnp.sum(hit + wrong + timeout)
    latency_s = jnp.where(hit > 0, recorded["latency_s"], jnp.nan)
    by_key = jnp.sum(wrong[:, None] * recorded["key_pressed"], axis=0)
    tilt_deg = jnp.where(counts, recorded["tilt_deg"], 0.0)
    return {
        "requests": decided,
        "correct_fraction": jnp.where(decided > 0, jnp.sum(hit) / decided, jnp.nan),
        "latency_median_s": jnp.nanmedian(latency_s),
        "latency_95_s": jnp.nanpercentile(latency_s, 95.0),
        "wrong_presses": jnp.sum(wrong),
        "timeouts": jnp.sum(timeout),
        "stray_presses": jnp.sum(stray),
        **{f"wrong_{n}": by_key[i] for i, n in enumerate(KEY_NAMES)},
        "max_tilt_deg": jnp.max(tilt_deg),
        "stance_drift_mm": 1e3 * _drift_m(recorded["support_pos_w"], counts),
        "least_support_fraction": _least_support(recorded["support_force_n"], counts),
    }


def _least_support(
    support_force_n: Float[Array, "T tips"], counts: Bool[Array, " T"]
) -> Float[Array, ""]:
    """Share of the steps that count in which the tip that stands least stands [1]."""
    stands = jax.vmap(in_contact, (0, None))(support_force_n, FORCE_THRESHOLD_N)
    return jnp.min(jnp.sum(stands & counts[:, None], axis=0)) / jnp.sum(counts)


def _drift_m(
    support_pos_w: Float[Array, "T tips 2"], counts: Bool[Array, " T"]
) -> Float[Array, ""]:
    """Mean distance of the tips between an early and the last step that counts [m]."""
    last = jnp.maximum(jnp.sum(counts) - 1, 0)
    first = jnp.minimum(_SETTLED_STEPS, last)
    moved = support_pos_w[last] - support_pos_w[first]
    return jnp.mean(jnp.linalg.norm(moved, axis=-1))


_SETTLED_STEPS = 25
