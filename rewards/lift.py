"""Lift objective: vertical tip motion at a stepping frequency set by the command."""

import flax.struct
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from rewards.gates import (
    DEAD_SPEED_MPS,
    FORCE_THRESHOLD_N,
    in_contact,
    is_commanded,
)
from rewards.shaping import Number, Scalar, safe_norm, smoothstep


@flax.struct.dataclass
class LiftParams:
    """Constants of the lift objective; defaults are the paper's.

    Attributes:
        speed_low_mps: commanded speed at and below which the lowest frequency holds.
        speed_high_mps: commanded speed at and above which the highest one holds.
        frequency_low_hz: lowest stepping frequency.
        frequency_high_hz: highest stepping frequency.
        tau_s: time constant of the moving average.
        amplitude_low_mps: z_min, magnitude of the average below which nothing is paid.
        amplitude_high_mps: z_max, magnitude from which the full z_max is paid.
        force_threshold_n: F_th, see `rewards.gates.in_contact`.
        dead_speed_mps: v_dead, see `rewards.gates.is_commanded`.
    """

    speed_low_mps: Number = 0.02
    speed_high_mps: Number = 0.16
    frequency_low_hz: Number = 1.0
    frequency_high_hz: Number = 3.5
    tau_s: Number = 0.3
    amplitude_low_mps: Number = 0.005
    amplitude_high_mps: Number = 0.015
    force_threshold_n: Number = FORCE_THRESHOLD_N
    dead_speed_mps: Number = DEAD_SPEED_MPS


@flax.struct.dataclass
class LiftMemory:
    """What the lift objective carries from step to step.

    Replace it by `init_lift_memory()` at every episode start and command resampling.

    Attributes:
        phase: φ [rad] in [0, 2π).
        average: z, real and imaginary part in the last axis [m/s]. Two reals, because
            complex arrays lack gradients, checkpoints or kernels on some platforms.
        touched: whether each tip was in contact since the latest phase wrap.
    """

    phase: Float[Array, "*b"]
    average: Float[Array, "*b tips 2"]
    touched: Bool[Array, "*b tips"]


def init_lift_memory(tips: int = 5) -> LiftMemory:
    """Memory at the start of an episode or of a command: all zero, nothing touched."""
    return LiftMemory(
        phase=jnp.zeros(()),
        average=jnp.zeros((tips, 2)),
        touched=jnp.zeros((tips,), bool),
    )


def lift_frequency_hz(
    speed_mps: Float[Array, ""], params: LiftParams
) -> Float[Array, ""]:
    """Stepping frequency, linear in the commanded speed and clamped at both ends.

    f = f_low + clip((|v_cmd| − v_low)/(v_high − v_low), 0, 1) (f_high − f_low).

    Args:
        speed_mps: commanded planar speed |v_cmd| [m/s], ≥ 0.
        params: end points; the paper maps 0.02–0.16 m/s to 1–3.5 Hz.

    Returns:
        Frequency [Hz] between the two ends; also below the dead speed, where the phase
        goes on at the lowest frequency while the gate is closed.

    Source:
        Paper, "Auxiliary lift objective".

    Examples:
        >>> import jax
        >>> speeds_mps = jnp.array([0.0, 0.09, 0.16])
        >>> print(jax.vmap(lambda v: lift_frequency_hz(v, LiftParams()))(speeds_mps))
        [1.   2.25 3.5 ]
    """
    span_mps = params.speed_high_mps - params.speed_low_mps
    t = jnp.clip((speed_mps - params.speed_low_mps) / span_mps, 0.0, 1.0)
    span_hz = params.frequency_high_hz - params.frequency_low_hz
    return params.frequency_low_hz + t * span_hz


def lift_gate(
    tip_force_n: Float[Array, " tips"],
    touched: Bool[Array, " tips"],
    command_planar: Float[Array, "2"],
    params: LiftParams,
) -> Bool[Array, " tips"]:
    """Gate g_j = (F_j < F_th) ∧ (touched since the wrap) ∧ (|v_cmd| ≥ v_dead).

    Args:
        tip_force_n: contact force magnitudes [N].
        touched: contact memory that already includes this step.
        command_planar: commanded planar velocity [m/s].
        params: thresholds.

    Returns:
        One flag per tip.

    Source:
        Paper, "Auxiliary lift objective", gate g.
    """
    airborne = ~in_contact(tip_force_n, params.force_threshold_n)
    return airborne & touched & is_commanded(command_planar, params.dead_speed_mps)


def lift_step(
    memory: LiftMemory,
    tip_vel_z: Float[Array, " tips"],
    tip_force_n: Float[Array, " tips"],
    command_planar: Float[Array, "2"],
    dt_s: Scalar,
    params: LiftParams,
) -> tuple[LiftMemory, Float[Array, ""]]:
    """One control step of the lift objective.

    φ ← φ + 2π f(|v_cmd|) Δt; z_j ← (1 − α) z_j + α u_j e^{−iφ}, α = Δt/(Δt + τ);
    magnitude Σ_j g_j z_max S(z_min, z_max, |z_j|).

    A tip that swings as u = A cos(2πft + ψ) settles at z ≈ (A/2) e^{iψ}, so the full
    reward starts at A = 2 z_max. Order within a step, where the paper is silent: phase
    advances, a wrap clears the contact memory, contact of this step is entered (it
    belongs to the cycle that has just begun), the average takes the new phase, and the
    gate reads the new memory.

    Args:
        memory: memory of the step before.
        tip_vel_z: u, vertical tip velocities relative to the rotating base in V [m/s].
        tip_force_n: contact force magnitudes [N].
        command_planar: commanded planar velocity in V [m/s].
        dt_s: control interval Δt [s], > 0.
        params: constants.

    Returns:
        New memory and magnitude [m/s] in [0, tips · z_max].

    Source:
        Paper, eq. (2).

    Examples:
        A thumb that swings at the commanded 2.5 Hz with 0.03 m/s, and lands once in a
        cycle of 20 steps, is paid in full after 3 s:

        >>> import jax
        >>> def swing(memory, k):
        ...     u = 0.03 * jnp.cos(2 * jnp.pi * k / 20) * (jnp.arange(5) == 0)
        ...     force_n = jnp.where((jnp.arange(5) == 0) & (k % 20 != 5), 0.0, 1.0)
        ...     command = jnp.array([0.104, 0.0])
        ...     return lift_step(memory, u, force_n, command, 0.02, LiftParams())
        >>> start = init_lift_memory()
        >>> memory, paid = jax.lax.scan(swing, start, jnp.arange(1, 151))
        >>> print(f"{paid[0]:.3f} {paid[-1]:.3f} m/s")
        0.000 0.015 m/s
    """
    frequency_hz = lift_frequency_hz(safe_norm(command_planar), params)
    phase, wrapped = _advance(memory.phase, 2.0 * jnp.pi * frequency_hz * dt_s)
    contact = in_contact(tip_force_n, params.force_threshold_n)
    touched = (memory.touched & ~wrapped) | contact
    average = _average(memory.average, tip_vel_z, phase, dt_s / (dt_s + params.tau_s))
    gate = lift_gate(tip_force_n, touched, command_planar, params)
    low, high = params.amplitude_low_mps, params.amplitude_high_mps
    magnitude = jnp.sum(gate * high * smoothstep(low, high, safe_norm(average)))
    return LiftMemory(phase=phase, average=average, touched=touched), magnitude


def _advance(
    phase: Float[Array, ""], increment: Float[Array, ""]
) -> tuple[Float[Array, ""], Bool[Array, ""]]:
    """Returns the phase in [0, 2π) and whether it wrapped."""
    unwrapped = phase + increment
    return jnp.mod(unwrapped, 2.0 * jnp.pi), unwrapped >= 2.0 * jnp.pi


def _average(
    average: Float[Array, "tips 2"],
    tip_vel_z: Float[Array, " tips"],
    phase: Float[Array, ""],
    alpha: Scalar,
) -> Float[Array, "tips 2"]:
    """Returns the complex moving average after one sample of u e^{−iφ}."""
    turned = jnp.stack([jnp.cos(phase), -jnp.sin(phase)])
    return (1.0 - alpha) * average + alpha * tip_vel_z[:, None] * turned
