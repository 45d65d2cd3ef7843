"""Signals of keyboard pressing: goals of the fingertip, touches, the stance."""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from envs.config.settings.keyboard import KeyboardConfig
from envs.hand.stance import Stance
from envs.physics.base import PhysicsOutput
from envs.plant import Plant
from envs.rotations import unrotate
from envs.signals import Signals, tilt_from_level
from envs.tasks.keyboard.model import (
    ACTUATION_M,
    ARROWS,
    KEY_CENTRES_M,
    KEY_NAMES,
    TOP_M,
)
from envs.tasks.keyboard.stance import PLACEMENT, SUPPORTS, TIP_RADIUS_M
from envs.tasks.upright import fallen
from rewards import support_drift

PRESS_DEPTH_M = 0.001
"""How far below its actuation depth a press aims; ours."""

HOVER_M = 0.004
"""Gap between fingertip and keys while nothing is asked; ours."""


def goal_offsets(
    tip_w: Float[Array, "3"],
    hover_w: Float[Array, "2"],
    height_m: Float[Array, ""],
    requested: Float[Array, " keys"],
) -> dict[str, Float[Array, "..."]]:
    """From the pressing fingertip p to its goals, e_k = g_k − p.

    Args:
        tip_w: centre p of the fingertip in the world [m].
        hover_w: where it waits between requests, x and y [m].
        height_m: how much higher than nominal the keyboard is [m].
        requested: 1 at the requested key.

    Returns:
        `arrow_offset_m` to where it would press each arrow, `goal_offset_m` the same
        for the requested one, and `hover_offset_m` to where it waits, all [m].

    Source:
        Ours.
    """
    arrows = PLACEMENT.to_world(KEY_CENTRES_M[: len(ARROWS)])
    height = TOP_M + TIP_RADIUS_M - ACTUATION_M - PRESS_DEPTH_M + height_m
    goals_w = jnp.concatenate(
        [jnp.array(arrows), jnp.full((len(ARROWS), 1), height)], axis=1
    )
    offsets = goals_w - tip_w
    waiting_w = jnp.append(hover_w, TOP_M + TIP_RADIUS_M + HOVER_M)
    return {
        "arrow_offset_m": offsets,
        "goal_offset_m": requested[: len(ARROWS)] @ offsets,
        "hover_offset_m": waiting_w - tip_w,
    }


def support_signals(
    signals: Signals,
    tips_w: Float[Array, "tips 3"],
    start_w: Float[Array, "feet 2"],
    stance: Stance,
    limits: KeyboardConfig,
) -> dict[str, Float[Array, "..."]]:
    """The supporting fingertips, and whether the hand still stands.

    Lost are palm contact ∨ tilt ∨ d > d_max, with d the mean ‖p_j − p_j(0)‖.

    Args:
        signals: of this step.
        tips_w: fingertips in the world [m].
        start_w: where the supporting ones stood [m].
        stance: the stance, which defines V.
        limits: tilt [deg] and d_max [m].

    Returns:
        Positions and drift d [m], velocities [m/s], forces [N], tilt [°], gravity in V
        and `stance_lost` [1].

    Source:
        Paper, keyboard pressing (support, loss of stance); the limits are ours.
    """
    others = jnp.array(SUPPORTS)
    feet_w = tips_w[others, :2]
    drift_m = support_drift(feet_w, start_w)
    gravity_v = unrotate(jnp.array(stance.q_off), signals.gravity_b)
    lost = fallen(signals, limits) | (drift_m > limits.max_drift_m)
    return {
        "support_pos_w": feet_w,
        "support_start_w": start_w,
        "support_vel_w": signals.tip_vel_w[others],
        "support_force_n": signals.tip_force_n[others],
        "support_shear_n": signals.tip_shear_n[others],
        "drift_m": drift_m,
        "gravity_v": gravity_v,
        "tilt_deg": jnp.rad2deg(tilt_from_level(gravity_v)),
        "stance_lost": lost.astype(jnp.float32),
    }


def touched_by_others(plant: Plant, output: PhysicsOutput) -> Bool[Array, " keys"]:
    """Whether a key has contacts other than those with the pressing fingertip.

    c_k = [n_k > m_k], of n_k contacts in all and m_k with the fingertip.

    Args:
        plant: with the indices of the sensors.
        output: result of the physics; its sensors count contacts.

    Returns:
        c_k for each key [1].

    Source:
        Paper, keyboard pressing (keycap contact by other hand parts).
    """

    def count(kind: str) -> Float[Array, " keys"]:
        names = [f"{kind}_{name}" for name in KEY_NAMES]
        read = [plant.spec.read(output.sensordata, name)[0] for name in names]
        return jnp.stack(read)

    return count("touch") > count("finger") + 0.5
