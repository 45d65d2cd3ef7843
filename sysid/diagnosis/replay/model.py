"""Candidates, and the actuator chain of a candidate at one step of the motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from envs.actuator.effect import EffectKind, Params, Substep
from sysid.diagnosis.measured.resampling import SMOOTH_STEPS
from sysid.diagnosis.replay.band import EVERY
from sysid.diagnosis.replay.beside import LATE, ages
from sysid.diagnosis.replay.cascade import with_cascade
from sysid.diagnosis.replay.command import Commands
from sysid.diagnosis.replay.effects import ENTER, READ, RIGID, SLOW
from sysid.diagnosis.replay.link import EFFECTS as LINK_EFFECTS
from sysid.diagnosis.replay.link import MOST_ROTOR
from sysid.diagnosis.replay.motion import Motion, Track, motion_of, with_candidates
from sysid.diagnosis.replay.noise import spring_noise_gain
from sysid.diagnosis.replay.torque_slope import SLOPE, within_steps


@flax.struct.dataclass
class Nuisance:
    """Parameters that every candidate may adjust and that are no effect.

    Attributes:
        effort_gain, mass, push_gain: factors of the logged effort, of masses and
            inertias, and of the known push [1].
        skew_s: age of the angle against the effort [s].
        hold_s: mean age at which a torque acts [s].
        rotor: inertia on the motor's side of a play [kg·m²].
        ripple: share of the command's ripple that the logged effort lacks: 1 if it is
            the torque just before the target of its row, −1 just behind it, 0 if it is
            the mean of a row [1].
    """

    effort_gain: Float[Array, "*b c"]
    mass: Float[Array, "*b c"]
    skew_s: Float[Array, "*b c"]
    hold_s: Float[Array, "*b c"]
    push_gain: Float[Array, "*b c"]
    rotor: Float[Array, "*b c"]
    ripple: Float[Array, "*b c"]
    k_int: Float[Array, "*b c"]


@flax.struct.dataclass
class Row:
    """One step of the replay.

    Attributes:
        motion: of the joint.
        number: of the step, from 0.
        snap: fourth derivative of its angle [rad/s⁴].
        within: how far angle, speed and acceleration still go at the times
            `command.WITHIN` until the end of the step.
        command: what the servo follows [rad].
        ripple: mean of the command about the step less the command [rad].
        ahead: how far the command still goes at those times [rad].
    """

    motion: Motion
    number: Float[Array, "*t"]
    snap: Float[Array, "*t p"]
    within: tuple[Float[Array, "*t k p"], ...]
    command: Float[Array, "*t p c"]
    ripple: Float[Array, "*t p c"]
    ahead: Float[Array, "*t k p c"]


@dataclass(frozen=True, eq=False)
class Candidates:
    """Parameters of all candidates, with a first axis for the pieces.

    Attributes:
        track: what the pieces have once.
        effects: parameters of the effects in front of the link, in their order.
        nuisance: the other parameters.
        linked: whether the link of any of them may move against its motor.
        gap_rad, compliance: of the link.
        spring_gain: noise gain of the spring [1].
        age: of the readings; see `beside.ages`. None where none is late.
        dt: step of the grid [s].
    """

    track: Track
    effects: Mapping[str, Params]
    nuisance: Nuisance
    linked: bool
    gap_rad: Float[Array, "1 c"]
    compliance: Float[Array, "1 c"]
    spring_gain: Float[Array, "p c"]
    age: Float[Array, "2 c"] | None
    dt: float

    @property
    def smoothing_s2(self) -> float:
        """Half the variance v of the smoothing: it adds v ẍ to a signal x [s²]."""
        return 0.5 * (SMOOTH_STEPS * self.dt) ** 2

    def state_of(self, name: str) -> int:
        """Place of an effect's state in the chain; 0 without the effect."""
        names = list(self.effects)
        return 1 + names.index(name) if name in names else 0

    def reading(self, now: Motion) -> tuple[Float[Array, "p c"], Float[Array, "p c"]]:
        """Angle and speed of the encoder, smoothed: y = p + Δ ṗ, ẏ = ṗ + Δ p̈.

        Args:
            now: one step of the motion, with a last axis for the candidates.

        Returns:
            y [rad] and ẏ [rad/s] at the age Δ (`skew_s`) of the angle.

        Source:
            Ours; Taylor expansion to first order in Δ ≪ 4 ms.
        """
        skew = self.nuisance.skew_s
        return now.pos + skew * now.vel, now.vel + skew * now.acc

    def sharp_reading(
        self, now: Motion
    ) -> tuple[Float[Array, "p c"], Float[Array, "p c"]]:
        """The same before smoothing: y° = y − v ÿ, ẏ° = ẏ − v d³p/dt³.

        Args:
            now: one step of the motion, with a last axis for the candidates.

        Returns:
            Angle [rad] and speed [rad/s] without the smoothing of variance 2 v.

        Source:
            Ours; a Gaussian of variance 2 v adds v ẍ to first order.
        """
        angle, speed = self.reading(now)
        return (
            angle - self.smoothing_s2 * (now.acc + self.nuisance.skew_s * now.jerk),
            speed - self.smoothing_s2 * now.jerk,
        )

    def passes(self, x: Substep, way: Float[Array, "p 1"]) -> Float[Array, "p c"]:
        """Share of a small torque that friction lets pass, h = 1 − ∂F/∂τ sign q̇ [1].

        Args:
            x: signals of the chain, with torque and load [N·m].
            way: direction of the motion in [−1, 1].

        Source:
            Ours; the derivative of `load_friction`, F = |K_m τ − K_e τ_load|.
        """
        shares = self.effects.get("load_friction")
        if shares is None:
            return jnp.ones_like(x.torque)
        rest = shares["drive_share"] * x.torque - shares["load_share"] * x.load
        return jnp.abs(1.0 - shares["drive_share"] * jnp.sign(rest) * way)

    def chain(self, row: Row) -> Sequence[tuple[EffectKind, Params]]:
        """The effects with their parameters as they act at one step."""
        now, track = row.motion, self.track
        gain, skew = self.nuisance.effort_gain, self.nuisance.skew_s
        enter = {
            "effort": gain * now.effort,
            "measured": track.measured[:, None],
            "ripple": self.nuisance.ripple * row.ripple,
        }
        slow = {"slow_vel": now.slow_vel + 0.0 * gain}
        angle, speed, acc = (x[:, :, None] for x in row.within)
        within = {
            "error": row.ahead - angle - skew * speed,
            "speed": speed + skew * acc,
        }
        body = (
            (RIGID[n], {**p, **within} if n == SLOPE.name else p)
            for n, p in self.effects.items()
        )
        sharp_angle, sharp_speed = self.sharp_reading(now)
        read = {"angle": sharp_angle, "speed": sharp_speed}
        return ((SLOW, slow), *body, (READ, read), (ENTER, enter))


def make_candidates(
    track: Track,
    params: dict[str, dict[str, Float[Array, " c"]]],
    nuisance: Nuisance,
    dt: float,
    names: tuple[str, ...],
) -> Candidates:
    """Gives parameters x_c an axis for the pieces: x_pc = x_c for all p.

    Args:
        track: measured motion of the joint.
        params: values by effect and parameter, in the parameters' units.
        nuisance: the other parameters.
        dt: step of the grid [s].
        names: effects in the order of the chain; see `residuals.equation_error`.

    Returns:
        The candidates, with the noise gains of their springs [1].

    Source:
        Ours: one compilation serves all candidates.
    """
    wide = {
        n: {k: v[None, :] for k, v in params[n].items()} for n in names if n in RIGID
    }
    nuisance = jax.tree.map(lambda v: v[None, :], nuisance)
    wide = with_cascade(wide, track.cascade, nuisance.k_int)
    gap, compliance, rotor = _link_of(params, nuisance.rotor)
    whole = nuisance.mass * jnp.mean(track.inertia, 0)[:, None]
    inner = jnp.minimum(rotor, MOST_ROTOR * whole)
    noise = (track.noise[1, 0], track.noise[1, 3], EVERY * dt)
    gain = spring_noise_gain(whole - inner, inner, compliance, *noise)
    nuisance = replace(nuisance, rotor=rotor)
    age = ages(params, dt) if any(effect in names for effect, _ in LATE) else None
    linked = any(effect in names for effect in LINK_EFFECTS)
    return Candidates(track, wide, nuisance, linked, gap, compliance, gain, age, dt)


def _link_of(params, rotor):
    """Returns play, compliance and the motor's inertia of the candidates."""
    absent = {"gap_rad": jnp.zeros_like(rotor[0])}
    gap = params.get("backlash", absent)["gap_rad"][None]
    spring = params.get("compliance")
    if spring is None:
        return gap, jnp.zeros_like(gap), rotor
    soft, own = spring["compliance_rad_nm"][None], spring["motor_inertia_kgm2"][None]
    return gap, soft, jnp.where(soft > 0.0, own, rotor)


def rows_of(track: Track, commands: Commands, dt: float) -> Row:
    """Puts the motion and the commands of all steps together.

    Args:
        track: measured motion of the joint.
        commands: what the servo follows [rad]; see `command.command_path`.
        dt: step of the grid [s].

    Returns:
        All steps; the snap is the difference quotient d⁴p/dt⁴ ≈ ∇(jerk) / h, and
        angles and speeds within a step are those before smoothing, p − v p̈.

    Source:
        Ours.
    """
    half = 0.5 * (SMOOTH_STEPS * dt) ** 2
    angle, speed = track.pos - half * track.acc, track.vel - half * track.jerk
    within = (
        within_steps(angle, speed, dt),
        within_steps(speed, track.acc, dt),
        within_steps(track.acc, track.jerk, dt),
    )
    snap = jnp.asarray(jnp.gradient(track.jerk, dt, axis=0))
    ripple = track.between * commands.ripple
    number = jnp.arange(len(snap), dtype=snap.dtype)
    targets = commands.path, ripple, commands.ahead
    return Row(motion_of(track), number, snap, within, *targets)


def at_step(row: Row) -> Row:
    """One step with a last axis for the candidates on what they have in common."""
    return replace(row, motion=with_candidates(row.motion), snap=row.snap[:, None])
