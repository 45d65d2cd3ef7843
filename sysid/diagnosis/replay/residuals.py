"""The actuator chain led along the measured motion, for many candidates at once.

Instead of simulating the joint, the chain is run on the angles that were measured. Two
residuals come out of every candidate, both in N·m:

    controller:  measured effort − what the servo makes of target and measured angle
    mechanics:   torque behind the gears + load − (I + J) q̈ − b q̇ − friction

where the effort was logged it is also what enters the gears, so neither residual knows
of errors in the other part; without it the servo's own torque enters. Nothing is
integrated, so nothing drifts, sticks wrongly or needs an initial state.

Candidates differ in numbers only: every effect of the catalogue is present, those that
a candidate does not have at their identity. One compilation serves all of them.
"""

import dataclasses
from collections.abc import Mapping
from functools import partial

import flax.struct
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.chain import JointInput, chain_step, init_states
from envs.actuator.effect import EffectKind, Stage
from envs.actuator.surroundings import Gravity, Surroundings
from sysid.diagnosis.measured.resampling import SMOOTH_STEPS
from sysid.diagnosis.replay import command, link
from sysid.diagnosis.replay.torque_slope import SLOPE, within_steps

BAND_STEPS = 2.2
"""Width of the Gaussian through which both residuals pass [steps of the grid]."""

EVERY = 4
"""Steps of the grid between two samples of a residual."""

_HALF = 8
TAPS = np.exp(-0.5 * (np.arange(-_HALF, _HALF + 1) / BAND_STEPS) ** 2)
TAPS = TAPS / TAPS.sum()

FINE_TAPS = np.exp(-0.5 * (np.arange(-4, 5) / SMOOTH_STEPS) ** 2)
FINE_TAPS = FINE_TAPS / FINE_TAPS.sum()


@flax.struct.dataclass
class Track:
    """Measured motion of one joint in all pieces (p), step by step (t).

    Attributes:
        cmd, pos, vel, acc, jerk: target, encoder angle and its derivatives.
        held, sent: see `Piece`.
        slow_vel: speed that passed the band of the residuals, for friction.
        effort: measured torque of the drive [N·m]; zero where it is not logged.
        push: torque of all that is neither drive nor gravity [N·m].
        ext: known push from outside, in its unit.
        inertia: of the joint with all that it carries, in this posture [kg·m²].
        moment, turned: moment of the carried masses, and the same a quarter turn on
            [kg·m]; see `effects.surroundings.Gravity`.
        gravity: in the frame of the mount [m/s²] (p, 3).
        payload_moment, payload_shift, payload_inertia, payload_kg: of the payload.
        others_nm, other_q, other_nm: what the neighbours do.
        kp, kd: nominal gains by piece.
        measured: 1 where the logged effort enters the gears, else 0 (p).
        between: 1 where the command's ripple hides between the readings, else 0.
        noise: noise of angle, its two derivatives and effort in both residuals, behind
            their band and what whitens them.
    """

    cmd: Float[Array, "t p"]
    held: Float[Array, "t s p"]
    sent: Float[Array, "t s p"]
    pos: Float[Array, "t p"]
    vel: Float[Array, "t p"]
    acc: Float[Array, "t p"]
    jerk: Float[Array, "t p"]
    slow_vel: Float[Array, "t p"]
    effort: Float[Array, "t p"]
    push: Float[Array, "t p"]
    ext: Float[Array, "t p"]
    inertia: Float[Array, "t p"]
    moment: Float[Array, "t p 3"]
    turned: Float[Array, "t p 3"]
    payload_moment: Float[Array, "t p 3"]
    payload_shift: Float[Array, "t p 3 3"]
    payload_inertia: Float[Array, "t p"]
    others_nm: Float[Array, "t p"]
    other_q: Float[Array, "t p"]
    other_nm: Float[Array, "t p"]
    gravity: Float[Array, "p 3"]
    payload_kg: Float[Array, " p"]
    kp: Float[Array, " p"]
    kd: Float[Array, " p"]
    measured: Float[Array, " p"]
    between: Float[Array, ""]
    noise: Float[Array, "2 4"]


_STEPWISE = tuple(
    f.name
    for f in dataclasses.fields(Track)
    if f.name
    not in (
        *("cmd", "held", "sent"),
        *("gravity", "payload_kg", "kp", "kd", "measured", "between", "noise"),
    )
)


WALKING = ("finger_weakness",)
"""Effects on joints that only records of a walking hand tell from other effects."""


def joint_effects() -> tuple[str, ...]:
    """Returns the effects of the catalogue that a joint can have, in their order."""
    return tuple(n for n, kind in CATALOGUE.items() if kind.acts and n not in WALKING)


def _pseudo(name: str, acts: Mapping[Stage, object], init=None) -> EffectKind:
    extra = {"init": init} if init else {}
    return EffectKind(name, "", {}, acts, {}, "", **extra)  # pyright: ignore


def _slow(params, state, x, dt):
    """Friction sees the speed without the noise of differentiation."""
    return state, x.replace(qd=params["slow_vel"])


def _sag(params, state, x, dt):
    """Divides the torque by what all joints ask for, where the others' is measured.

    Of the others' demands d the measured torques are V d, so V = 1 / (1 + s (τ + Σ d))
    becomes (1 − s Σ V d) / (1 + s τ).
    """
    sag = params["sag_per_nm"]
    own = 1.0 / (1.0 + sag * jnp.abs(x.torque))
    left = jnp.maximum(1.0 - sag * x.around.others_nm, 0.0) * own
    return state, x.replace(torque=left * x.torque, follows=left * own * x.follows)


def _enter(params, state, x, dt):
    """Remembers the servo's torque and lets the measured one enter the gears."""
    mixed = x.torque + params["measured"] * (params["effort"] - x.torque)
    return x.torque, x.replace(torque=mixed + x.follows * x.kp * params["ripple"])


def _read(params, state, x, dt):
    """Remembers what the encoder would tell, and lets the servo have what it told."""
    told = x.replace(encoder=params["angle"], encoder_speed=params["speed"])
    return (x.encoder, x.encoder_speed), told


_READ = _pseudo(
    "measured_angle",
    {Stage.ENCODER: _read},
    lambda params, target, q, dt: (jnp.zeros_like(q), jnp.zeros_like(q)),
)
_SLOW = _pseudo("slow_speed", {Stage.FRICTION: _slow})
_ENTER = _pseudo(
    "measured_effort",
    {Stage.TORQUE: _enter},
    lambda params, target, q, dt: jnp.zeros_like(q),
)
KINDS = {
    name: CATALOGUE[name] for name in joint_effects() if name not in command.EFFECTS
}
"""Effects that act behind the command path."""

_RIGID = {n: kind for n, kind in KINDS.items() if n not in link.EFFECTS}
_RIGID[SLOPE.name] = SLOPE
_SAG = CATALOGUE["supply_sag"]
_RIGID[_SAG.name] = dataclasses.replace(_SAG, acts={Stage.TORQUE: _sag})


@partial(jax.jit, static_argnames=("dt", "names"))
def forced_residuals(
    track: Track,
    params: dict[str, dict[str, Float[Array, " c"]]],
    nuisance: dict[str, Float[Array, " c"]],
    friction_speed: Float[Array, ""],
    dt: float,
    names: tuple[str, ...],
) -> Float[Array, "2 m p c"]:
    """Returns the residuals (controller, mechanics) of candidates c [N·m].

    Where a joint may be at rest, its friction is whatever balances it: those samples
    of the mechanics must not count. Near them friction turns round within the band.

    Angles are noisy themselves, so both residuals are divided by the noise that a
    candidate would have, relative to the simulation as it stands: otherwise the fit
    would lower gains to silence the noise that they amplify. (The density of readings
    whose exact values are unknown, at the most likely ones, has no other term.)

    Args:
        track: the measured motion.
        params: values of the parameters of the effects by name.
        nuisance: `effort_gain`, `mass`, `push_gain` (factors), `skew_s` (age of the
            angle against the effort), `hold_s` (mean age at which a torque acts),
            `rotor` (inertia on the motor's side of a play [kg·m²]).
        friction_speed: speed below which a joint may be at rest.
        dt: step of the grid [s].
        names: effects in the order of the chain.
    """
    path, ripple, ahead = command.command_path(track.held, track.sent, params, dt)
    ripple = track.between * ripple
    wide = {
        n: {k: v[None, :] for k, v in params[n].items()} for n in names if n in _RIGID
    }
    figures = ("effort_gain", "mass", "skew_s", "hold_s", "push_gain", "rotor")
    gain, mass, skew, hold, pushed, rotor = (nuisance[k][None, :] for k in figures)
    gap, soft, rotor = _between(params, rotor)
    whole = mass * jnp.mean(track.inertia, 0)[:, None]
    inner = jnp.minimum(rotor, link.MOST_ROTOR * whole)
    heard = (track.noise[1, 0], track.noise[1, 3], EVERY * dt)
    shaken = link.spring_noise(whole - inner, inner, soft, *heard)

    def smooth_read(now):
        """Returns angle and speed that the encoder told, as they were smoothed."""
        return (
            now["pos"] + skew * now["vel"],
            now["vel"] + skew * now["acc"],
        )

    def sharp_read(now):
        """Returns them before they were smoothed."""
        angle, speed = smooth_read(now)
        return (
            angle - dull * (now["acc"] + skew * now["jerk"]),
            speed - dull * now["jerk"],
        )

    def model(now, ripple, ahead):
        effort = gain * now["effort"]
        measured = track.measured[:, None]
        enter = {"effort": effort, "measured": measured, "ripple": ripple}
        slow = {"slow_vel": now["slow_vel"] + 0.0 * gain}
        moved, turned, eased = (x[:, :, None] for x in now["within"])
        within = {
            "error": ahead - moved - skew * turned,
            "speed": turned + skew * eased,
        }
        body = (
            (_RIGID[n], p | within if n == SLOPE.name else p) for n, p in wide.items()
        )
        angle, speed = sharp_read(now)
        read = {"angle": angle, "speed": speed}
        return ((_SLOW, slow), *body, (_READ, read), (_ENTER, enter))

    def step(carry, row):
        states, last, told, steep, behind = carry
        row, within, target, ripple, ahead = row
        now = {k: v[:, None] for k, v in row.items()} | {"within": within}
        angle, rate = smooth_read(now)
        # The angle of which the encoder would tell this: a step of Newton's method.
        q = last + (angle - told) / steep
        qd = rate / steep
        away = (q - angle + behind[0])[..., None]
        moment = jnp.cos(away) * now["moment"] + jnp.sin(away) * now["turned"]
        moment = mass[..., None] * moment
        gravity = jnp.broadcast_to(track.gravity[:, None], moment.shape)
        load = now["push"] + pushed * now["ext"] + jnp.sum(moment * gravity, -1)
        payload_kg = jnp.broadcast_to(track.payload_kg[:, None], q.shape)
        around = Surroundings(
            others_nm=now["others_nm"],
            other_q=now["other_q"],
            other_nm=now["other_nm"],
            gravity=Gravity(
                gravity=gravity,
                moment=moment,
                payload_kg=payload_kg,
                payload_moment=now["payload_moment"],
                payload_shift=now["payload_shift"],
                payload_inertia=now["payload_inertia"],
            ),
        )
        kp, kd = track.kp[:, None], track.kd[:, None]
        joint = JointInput(target, q, qd, load, kp, kd, around)
        states, x = chain_step(model(now, ripple, ahead), states, joint, dt)
        inertia = mass * now["inertia"] + x.inertia
        share = jnp.maximum(x.follows, states[ramp][1] if ramp else 0.0)
        loud, usual = _loudness(track, now, x, share, gain, inertia / steep)
        own = jnp.minimum(rotor, link.MOST_ROTOR * inertia)
        # What encoders make of angles is as steep for speeds and accelerations.
        moves = jnp.abs(qd) > 1e-6
        encoder, speed = states[-2]
        ratio = speed / (qd + 1.0 * ~moves)
        before, steep = steep, ratio * moves + steep * ~moves
        acc = now["acc"] + (skew + hold) * now["jerk"]
        acc = (acc - (steep - before) / dt * qd) / steep  # y = f(q), ÿ = f' q̈ + ḟ' q̇
        force = x.passive + x.load - (inertia - own) * acc
        outer = inertia - own
        sharp = force + outer * dull * now["snap"] / steep
        way = jnp.clip(now["slow_vel"] / friction_speed, -1.0, 1.0)
        bears = x.passive + x.load - x.viscous * now["slow_vel"] - x.friction * way
        touch = (own * bears - outer * x.torque) / inertia
        behind, pull, loose = link.link_step(
            behind, force, sharp, touch, outer, gap, soft, dt
        )
        needs = x.torque - own * acc + pull
        unit = gain * shaken * loud[1] / usual[1]
        servo, (true_angle, true_rate) = states[-1], sharp_read(now)
        enters = (1.0 - track.measured[:, None]) / unit
        out = {
            "command": (servo + x.kp * true_angle + x.kd * true_rate) / gain,
            "answer": (x.kp * angle + x.kd * rate) / gain,
            "quiet": loud[0] / usual[0],
            "needs": needs / unit - enters * servo,
            "loose": loose / unit,
            "enters": gain * enters,
            "friction": x.friction / unit,
            "viscous": x.viscous / unit,
        }
        return (states, q, encoder, steep, behind), out

    dull = 0.5 * (SMOOTH_STEPS * dt) ** 2
    ramp = 1 + list(wide).index(SLOPE.name) if SLOPE.name in wide else 0
    rows = {k: getattr(track, k) for k in _STEPWISE}
    rows["snap"] = jnp.gradient(track.jerk, dt, axis=0)
    angle, speed = track.pos - dull * track.acc, track.vel - dull * track.jerk
    within = (
        within_steps(angle, speed, dt),
        within_steps(speed, track.acc, dt),
        within_steps(track.acc, track.jerk, dt),
    )
    first = {k: v[0][:, None] for k, v in rows.items()}
    q0 = jnp.broadcast_to(first["pos"], (*first["pos"].shape[:1], gain.shape[1]))
    none = jnp.zeros_like(q0)
    read = q0 + skew * first["vel"]
    at_rest = first | {"within": tuple(x[0] for x in within)}
    states = init_states(model(at_rest, ripple[0], ahead[0]), path[0], q0, dt)
    start = (states, read, read, none + 1.0, (none, none))
    out = jax.lax.scan(step, start, (rows, within, path, ripple, ahead))[1]
    vel, effort = track.slow_vel[:, :, None], track.effort[:, :, None]
    return _filtered(out, effort, vel, friction_speed)


def _between(params, rotor):
    """Returns play, compliance and the motor's inertia of the candidates."""
    absent = {"gap_rad": jnp.zeros_like(rotor[0])}
    gap = params.get("backlash", absent)["gap_rad"][None]
    spring = params.get("compliance")
    if spring is None:
        return gap, jnp.zeros_like(gap), rotor
    soft, own = spring["compliance_rad_nm"][None], spring["motor_inertia_kgm2"][None]
    return gap, soft, jnp.where(soft > 0.0, own, rotor)


def _loudness(track, now, x, share, gain, inertia):
    """Noise of the residuals of a candidate, and as the simulation stands [N·m].

    The servo's torque has its share of the noise that its gains make.
    """
    kp, kd, measured = (v[:, None] for v in (track.kp, track.kd, track.measured))
    servo, usual_servo = [], []
    for angle, speed, _, _ in track.noise:
        # A servo at its limit does not answer to the noise of the angle.
        servo.append(share * jnp.hypot(x.kp * angle, x.kd * speed) / gain)
        usual_servo.append(jnp.hypot(kp * angle, kd * speed))
    _, speed, acc, effort = track.noise[1]
    own = jnp.hypot(inertia * acc, x.viscous * speed) / gain
    usual_own = now["inertia"] * acc
    enters = servo[1] + measured * (effort - servo[1])
    usual_enters = usual_servo[1] + measured * (effort - usual_servo[1])
    told = track.noise[0, 3]
    loud = (jnp.hypot(servo[0], told), jnp.hypot(own, enters))
    usual = (jnp.hypot(usual_servo[0], told), jnp.hypot(usual_own, usual_enters))
    return loud, usual


def _filtered(out, effort, vel, friction_speed):
    """Passes the signals through the band and subtracts friction.

    The servo's torque is smoothed as the measured one was; its answer to angle and
    speed was smoothed with them.
    """
    way = jnp.clip(vel / friction_speed, -1.0, 1.0)
    servo = _smooth(out["command"]) - out["answer"]
    needs = out["needs"] - out["viscous"] * vel - out["friction"] * way
    mechanics = _band(needs + _smooth(out["loose"]) + out["enters"] * servo)
    return jnp.stack([_band((effort - servo) / out["quiet"]), mechanics])


def _smooth(x: Float[Array, "t p c"]) -> Float[Array, "t p c"]:
    """Smooths a torque as the measured channels were.

    The target is not smoothed before the chain: limits would act on round corners.
    """
    reach = len(FINE_TAPS) // 2
    wide = jnp.pad(x, [(reach, reach), (0, 0), (0, 0)], "edge")
    parts = [w * wide[k : k + len(x)] for k, w in enumerate(FINE_TAPS.tolist())]
    return jnp.sum(jnp.stack(parts), 0)


def _band(x: Float[Array, "t p c"]) -> Float[Array, "m p c"]:
    """Gaussian mean of every `EVERY`-th step."""
    count = (x.shape[0] - len(TAPS)) // EVERY + 1
    last = (count - 1) * EVERY + 1
    parts = [w * x[k : k + last : EVERY] for k, w in enumerate(TAPS.tolist())]
    return jnp.sum(jnp.stack(parts), 0)


def sample_rows(steps: int) -> np.ndarray:
    """Returns the steps of the grid at which the residuals are sampled."""
    count = (steps - len(TAPS)) // EVERY + 1
    return _HALF + EVERY * np.arange(count)
