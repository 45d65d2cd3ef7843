"""Noise of the readings: estimated, passed through the band, amplified by candidates.

A residual is a filtered difference of noisy readings, so a candidate's gains, inertia
and spring decide how large its noise is. Each residual is divided by its noise gain:
the noise of the candidate over that of the nominal simulation.
"""

from collections.abc import Sequence

import flax.struct
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.actuator.effect import Substep
from sysid.diagnosis.measured.resampling import SMOOTH_STEPS
from sysid.diagnosis.replay.band import BAND_STEPS, EVERY
from sysid.diagnosis.replay.link import DAMPING
from sysid.diagnosis.replay.motion import Motion, Track
from sysid.drive import JointDrive
from sysid.logs.log import MeasuredLog

POINTS = 64
"""Number of frequencies over which noise is averaged."""


@flax.struct.dataclass
class ResidualNoise:
    """Standard deviations of both residuals, without a spring [N·m].

    Attributes:
        controller, mechanics: the two residuals.
    """

    controller: Float[Array, "p _"]
    mechanics: Float[Array, "p _"]


def residual_noise(
    track: Track,
    now: Motion,
    x: Substep,
    passes: Float[Array, "p c"],
    effort_gain: Float[Array, "1 c"],
    inertia: Float[Array, "p c"],
) -> tuple[ResidualNoise, ResidualNoise]:
    """Noise of a candidate's residuals, and of the nominal simulation's.

    With noise s_0, s_1, s_2 of angle, speed and acceleration, s_e of the effort, the
    share f of its gains with which a servo follows, and the share h of a torque that
    passes friction which grows with it,

        servo       s_u² = f² ((kp s_0)² + (kd s_1)²) / g²
        controller  σ_1² = s_u² + s_e²
        mechanics   σ_2² = ((J s_2)² + (b s_1)²) / g² + (h s_τ)²

    where s_τ is s_e if the measured effort enters the gears, else s_u. Nominal: the
    same with the nominal gains and inertia, f = g = h = 1 and b = 0. Without h,
    friction that cancels the torque would cancel its noise and seem to explain it.

    Args:
        track: nominal gains, and the noise s.
        now: one step of the motion, with a last axis for the candidates.
        x: signals of the chain: gains kp, kd, viscous friction b, and f in [0, 1]: a
            servo at its limit does not answer to noise.
        passes: h = 1 − ∂F/∂τ in the direction of motion [1].
        effort_gain: g, factor of the logged effort [1].
        inertia: J, on the encoder's side [kg·m²].

    Returns:
        Both standard deviations [N·m], of the candidate and nominal.

    Source:
        Ours; propagation of independent errors to first order.
    """
    kp, kd, measured = (v[:, None] for v in (track.kp, track.kd, track.measured))
    servo, nominal = [], []
    for angle, speed, _, _ in track.noise:
        servo.append(x.follows * jnp.hypot(x.kp * angle, x.kd * speed) / effort_gain)
        nominal.append(jnp.hypot(kp * angle, kd * speed))
    _, speed, acc, effort = track.noise[1]
    own = jnp.hypot(inertia * acc, x.viscous * speed) / effort_gain
    nominal_own = now.inertia * acc
    enters = servo[1] + measured * (effort - servo[1])
    nominal_enters = nominal[1] + measured * (effort - nominal[1])
    logged = track.noise[0, 3]
    return (
        ResidualNoise(jnp.hypot(servo[0], logged), jnp.hypot(own, passes * enters)),
        ResidualNoise(
            jnp.hypot(nominal[0], logged), jnp.hypot(nominal_own, nominal_enters)
        ),
    )


def spring_noise_gain(
    inertia: Float[Array, "p c"],
    rotor: Float[Array, "p c"],
    compliance: Float[Array, "1 c"],
    angle: Float[Array, ""],
    effort: Float[Array, ""],
    step_s: float,
) -> Float[Array, "p c"]:
    """Noise of the needed torque with a spring over that of a rigid link.

    Noise of the motor's angle excites the link at its own frequency. Without this
    factor a fit would shift inertia to the motor, to reduce what the spring amplifies.

        A² = mean_ω (|J_m + J H|² ω⁴ s² + e²) / ((J_m + J)² ω⁴ s² + e²)

    with H = 1 / (1 − ω² J C + 2 i ζ ω √(J C)); a residual is white up to half its rate.

    Args:
        inertia: J, of the link [kg·m²].
        rotor: J_m, on the motor's side [kg·m²].
        compliance: C; 0 for none [rad/(N·m)].
        angle: s, noise of the angle [rad].
        effort: e, noise of the effort in the same band [N·m].
        step_s: time between samples of the residual [s].

    Returns:
        A ≥ 0 [1]; exactly 1 without a spring.

    Source:
        Ours; H is the transfer function of a damped spring from motor to link.
    """
    omega = jnp.pi / step_s * (jnp.arange(POINTS) + 0.5)[:, None, None] / POINTS
    acc = omega**2 * jnp.maximum(angle, 1e-12)
    lag = omega * jnp.sqrt(inertia * compliance)
    link = inertia / (1.0 - lag**2 + 2.0j * DAMPING * lag)
    soft = (jnp.abs(rotor + link) * acc) ** 2 + effort**2
    rigid = ((rotor + inertia) * acc) ** 2 + effort**2
    return jnp.where(compliance > 0.0, jnp.sqrt(jnp.mean(soft / rigid, 0)), 1.0)


def reading_noise(
    logs: Sequence[MeasuredLog], joint: str, drive: JointDrive, step_s: float
) -> tuple[float, float]:
    """Estimates the noise of angle and effort, as white noise of one step of the grid.

    Fourth differences of the readings hold little else than noise.
    """
    found = []
    for name in (f"pos.{joint}", f"{drive.effort}.{joint}"):
        kept = [log.samples(name) for log in logs if name in log.columns]
        each = [_fourth_differences(t_s, x, step_s) for t_s, x in kept]
        found.append(float(np.median(each)) if each else 0.0)
    return found[0], found[1] * drive.effort_scale.value


def _fourth_differences(t_s: np.ndarray, x: np.ndarray, step_s: float) -> float:
    """Standard deviation of the noise of readings, scaled to a step of the grid.

    The quieter parts of a record count, in which fast motion adds nothing.
    """
    period = float(np.median(np.diff(t_s)))
    d = np.abs(np.diff(x, 4)) / np.sqrt(70.0)
    size = max(float(np.quantile(d, 0.3)) / 0.3853, _step_of(x) / np.sqrt(12.0))
    return size * np.sqrt(min(period / step_s, 1.0))


def _step_of(x: np.ndarray) -> float:
    """Returns the step of a coarse encoder, whose readings come again; else 0.

    Rounding makes no steps: values that are so near to each other are one.
    """
    values = np.unique(x)
    gaps = np.diff(values)[np.diff(values) > 1e-9 * np.ptp(x)]
    return float(gaps.min()) if 0 < gaps.size < 0.5 * len(x) else 0.0


def band_noise(
    noise: tuple[float, float], step_s: float, whitening: Sequence[float] = ()
) -> Float[np.ndarray, "4"]:
    """Noise in the band of the residuals: angle, speed, acceleration, effort.

    White noise of variance σ² in every step h passes a Gaussian of width w, k
    derivatives, and the filter that makes a residual's noise white:

        σ_k² = (σ² h / π) ∫₀^{π/h} ω²ᵏ exp(−(ω w h)²) |1 − Σ a_n e^{−iω n E h}|² dω

    Args:
        noise: standard deviations of angle [rad] and effort [N·m] at a step.
        step_s: h [s].
        whitening: a_n, at every E-th step.

    Returns:
        σ_0 to σ_2 of the angle [rad], [rad/s], [rad/s²], and σ_0 of the effort [N·m].

    Source:
        Variance of filtered white noise: L. Ljung, System Identification: Theory for
        the User, 1999, section 2.3.
    """
    w = np.hypot(BAND_STEPS, SMOOTH_STEPS)
    omega = np.linspace(0.0, np.pi, 513)
    lags = EVERY * np.arange(1, len(whitening) + 1)
    passed = 1.0 - np.exp(-1j * np.outer(omega, lags)) @ np.asarray(whitening, float)
    power = np.exp(-((omega * w) ** 2)) * np.abs(passed) ** 2
    size = [np.sqrt(np.trapezoid(omega**k * power, omega) / np.pi) for k in (0, 2, 4)]
    angle, speed, acc = noise[0] * np.array(size) / step_s ** np.arange(3)
    return np.array([angle, speed, acc, noise[1] * size[0]])
