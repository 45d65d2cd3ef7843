"""The paper's measures of one episode, as pure functions of its time series.

Every function takes the arrays of one episode over control steps t and a mask `alive`
(1 up to the last step that counts, then 0; written m_t); callers vmap over episodes.
Averages run over the steps that count. A measure that an episode does not define, such
as the speed of an episode without a speed command, is NaN. The source is the paper
*Fingers as Legs*, "Measures" in its ablation; where it leaves a choice open, the
docstring says "ours".
"""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

CONTACT_N = 0.15
DEADBAND_MPS = 0.02
NAIL_TILT_RAD = jnp.deg2rad(64.0).item()
MIN_TOUCHDOWNS = 3
MIN_CONTACT_FRACTION = 0.05


def masked_mean(
    values: Float[Array, "T ..."], mask: Bool[Array, "T ..."]
) -> Float[Array, "..."]:
    """Σ_t m_t x_t / Σ_t m_t, in the unit of x [1 for flags]; NaN where no m_t is set.

    Values outside the mask may be anything, NaN included.

    Source:
        Ours: the mean over the steps that count.
    """
    total = jnp.where(mask, values, 0.0).sum(axis=0)
    count = mask.sum(axis=0)
    return jnp.where(count > 0, total / jnp.maximum(count, 1), jnp.nan)


def task_speed_mps(
    vel_v: Float[Array, "T 2"], command: Float[Array, "T 3"], alive: Bool[Array, " T"]
) -> Float[Array, ""]:
    """Progress in the commanded direction [m/s].

    mean over {t : ‖c_t‖ ≥ 0.02 m/s} of v_t · c_t / ‖c_t‖, with v the palm's planar
    velocity and c the planar command, both in V. Negative for motion the wrong way.
    Leaving out the steps of smaller commands, which have no direction, is ours; their
    threshold is the paper's dead band of the lift and direction objectives.

    Source:
        *Fingers as Legs*, Measures, "task speed".
    """
    planar = command[:, :2]
    speed = jnp.linalg.norm(planar, axis=1)
    direction = planar / jnp.maximum(speed, DEADBAND_MPS)[:, None]
    progress = jnp.sum(vel_v * direction, axis=1)
    return masked_mean(progress, alive & (speed >= DEADBAND_MPS))


def contacts(
    tip_force_n: Float[Array, "T tips"], alive: Bool[Array, " T"]
) -> Bool[Array, "T tips"]:
    """c_ti = (F_ti ≥ F_th) ∧ m_t: which tips carry at least 0.15 N [N] in which steps.

    Source:
        *Fingers as Legs*, contact threshold F_th.
    """
    return (tip_force_n >= CONTACT_N) & alive[:, None]


def touchdowns(
    tip_force_n: Float[Array, "T tips"], alive: Bool[Array, " T"]
) -> Float[Array, " tips"]:
    """Σ_t c_ti ∧ ¬c_{t-1,i}: number of rising edges of each tip's contact [1].

    The force is in [N]. A tip that stands at the start has not touched down yet (ours).

    Source:
        Ours: what `five_finger_participation` counts.
    """
    contact = contacts(tip_force_n, alive)
    return (contact[1:] & ~contact[:-1]).sum(axis=0).astype(jnp.float32)


def contact_fraction(
    contact: Bool[Array, "T tips"], alive: Bool[Array, " T"]
) -> Float[Array, " tips"]:
    """Σ_t m_t c_ti / Σ_t m_t in [0, 1]: fraction of steps with contact of each tip [1].

    Source:
        Ours: what `five_finger_participation` counts.
    """
    counted = jnp.broadcast_to(alive[:, None], contact.shape)
    return masked_mean(contact.astype(jnp.float32), counted)


def five_finger_participation(
    tip_force_n: Float[Array, "T tips"], alive: Bool[Array, " T"]
) -> Float[Array, ""]:
    """∧_i (touchdowns_i ≥ 3 ∧ contact fraction_i ≥ 0.05) as 0 or 1 [1].

    1 if every fingertip takes part in the gait; the force is in [N]. The mean over
    episodes is the fraction that the paper reports.

    Source:
        *Fingers as Legs*, Measures, "five-finger participation".
    """
    contact = contacts(tip_force_n, alive)
    return _participation(tip_force_n, contact, alive)


def non_nail_participation(
    tip_force_n: Float[Array, "T tips"],
    pad_tilt_rad: Float[Array, "T tips"],
    alive: Bool[Array, " T"],
) -> Float[Array, ""]:
    """∧_i (touchdowns_i ≥ 3 ∧ fraction of c_ti ∧ (θ_ti < 64°) ≥ 0.05) as 0 or 1 [1].

    As `five_finger_participation`, but only contact with a tilt θ [rad] below 64°
    counts towards the 5 % of the episode; all touchdowns count.

    Source:
        *Fingers as Legs*, Measures, "non-nail participation".
    """
    contact = contacts(tip_force_n, alive)
    padded = contact & (pad_tilt_rad < NAIL_TILT_RAD)
    return _participation(tip_force_n, padded, alive)


def contact_tilt_rad(
    tip_force_n: Float[Array, "T tips"],
    pad_tilt_rad: Float[Array, "T tips"],
    alive: Bool[Array, " T"],
) -> Float[Array, " tips"]:
    """Σ_t c_ti θ_ti / Σ_t c_ti: mean tilt of each tip while in contact [rad].

    The tilt θ is the elevation of the pad's normal above the horizontal: -π/2 lies flat
    on the pad, +π/2 stands on the nail; NaN for a tip never down. `nanmean` and
    `nanmax` over tips give the mean and the worst tip.

    Source:
        *Fingers as Legs*, Measures, contact posture.
    """
    return masked_mean(pad_tilt_rad, contacts(tip_force_n, alive))


def worst_tip_planting_fraction(
    tip_force_n: Float[Array, "T tips"],
    pad_tilt_rad: Float[Array, "T tips"],
    alive: Bool[Array, " T"],
) -> Float[Array, ""]:
    """min_i Σ_t c_ti (θ_ti < 64°) / Σ_t c_ti in [0, 1], from tilts θ [rad].

    The tip with the largest fraction of nail-side contact has the smallest fraction of
    the other side. Tips never in contact do not count (ours); NaN if none is.

    Source:
        *Fingers as Legs*, Measures, "worst-tip planting fraction".
    """
    below = (pad_tilt_rad < NAIL_TILT_RAD).astype(jnp.float32)
    return jnp.nanmin(masked_mean(below, contacts(tip_force_n, alive)))


def undesired_contact_rate(
    undesired: Bool[Array, " T"], alive: Bool[Array, " T"]
) -> Float[Array, ""]:
    """Σ_t m_t u_t / Σ_t m_t in [0, 1] [1]; u_t: the palm or a link but a tip touches.

    Source:
        Ours.
    """
    return masked_mean(undesired.astype(jnp.float32), alive)


def energy_j(
    power_w: Float[Array, " T"], alive: Bool[Array, " T"], dt_s: float
) -> Float[Array, ""]:
    """Mechanical work of the joints without recuperation [J]: Σ_t P_t Δt.

    P = Σ_i |τ_i ω_i| [W] with torque τ [N·m] and speed ω [rad/s] of joint i, sampled
    once per control step. Heat of the motors is not included.

    Source:
        Ours.
    """
    return jnp.where(alive, power_w, 0.0).sum() * dt_s


def path_speed_mps(
    palm_pos_w: Float[Array, "T 3"],
    alive: Bool[Array, " T"],
    dt_s: float,
    window_s: float = 1.0,
) -> Float[Array, ""]:
    """Speed along the palm's path over the floor [m/s].

    mean_t ‖p_{t+w} - p_t‖ / w with the horizontal position p: displacement over a
    sliding window of one second, so that swaying within a stride does not count as
    travel (ours; at the largest turn rate of 0.45 rad/s a chord is 0.8 % shorter than
    its arc). NaN for an episode shorter than the window.

    Source:
        *Fingers as Legs*, hardware, "mean path speed".
    """
    lag = min(max(1, round(window_s / dt_s)), len(palm_pos_w) - 1)
    short = alive.sum() * dt_s <= window_s - dt_s / 2
    step = palm_pos_w[lag:, :2] - palm_pos_w[:-lag, :2]
    speed = jnp.linalg.norm(step, axis=1) / (lag * dt_s)
    return jnp.where(short, jnp.nan, masked_mean(speed, alive[lag:]))


def cost_of_transport(
    energy: Float[Array, ""],
    path_speed: Float[Array, ""],
    duration_s: Float[Array, ""],
    mass_kg: float,
    gravity_mps2: float = 9.81,
) -> Float[Array, ""]:
    """COT = E / (m g v T) [1]: energy over weight and distance; NaN at rest.

    Source:
        Gabrielli and von Kármán, "What price speed?", Mechanical Engineering, 1950,
        as specific resistance.
    """
    distance = path_speed * duration_s
    return jnp.where(
        distance > 0, energy / (mass_kg * gravity_mps2 * distance), jnp.nan
    )


def survival(failed: Bool[Array, " T"]) -> Float[Array, ""]:
    """1 - max_t failed_t ∈ {0, 1} [1]: whether no failure ended the episode early.

    Source:
        *Fingers as Legs*, terminations.
    """
    return 1.0 - failed.any().astype(jnp.float32)


def steps_alive(
    done: Bool[Array, " T"], failed: Bool[Array, " T"]
) -> Bool[Array, " T"]:
    """m_t = (Σ_{s<t} done_s = 0) ∧ ¬failed_t [1]: which steps of an episode count.

    All up to the first `done`. That step itself counts where the time limit ended the
    episode, and not where a failure did: a fallen hand walks no more.

    Source:
        Ours.
    """
    ended = jnp.cumsum(done.astype(jnp.int32))
    return (ended - done == 0) & ~failed


def _participation(
    tip_force_n: Array, counted: Array, alive: Array
) -> Float[Array, ""]:
    steps = touchdowns(tip_force_n, alive) >= MIN_TOUCHDOWNS
    share = contact_fraction(counted, alive) >= MIN_CONTACT_FRACTION
    return jnp.all(steps & share).astype(jnp.float32)
