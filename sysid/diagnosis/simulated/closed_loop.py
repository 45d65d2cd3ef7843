"""Simulation of one joint along its records, as training simulates it but for a play.

Chain and joint are integrated from a measured state, at substeps that are short enough
for their own lag not to count. Where the servo's law is known, a candidate follows the
sent targets alone, from the start of every piece; where it is not, the logged effort
drives the joint, in windows too short for errors to add up (multiple shooting).
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from envs.actuator.chain import JointInput, chain_step, init_states
from envs.actuator.effect import Substep
from envs.actuator.joint import joint_step
from sysid.diagnosis.fits.lanes import in_lanes, lanes_first
from sysid.diagnosis.fits.memory import remembered
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.fits.programs import Program, programs
from sysid.diagnosis.replay import band, cascade
from sysid.diagnosis.replay.acting import are_acting
from sysid.diagnosis.replay.beside import LATE, ages, beside
from sysid.diagnosis.replay.effects import ENTER
from sysid.diagnosis.replay.model import Nuisance
from sysid.diagnosis.replay.motion import Motion, Track, with_candidates
from sysid.diagnosis.replay.surroundings import surroundings_at
from sysid.diagnosis.side_by_side import side_by_side
from sysid.diagnosis.simulated import play
from sysid.diagnosis.simulated.known import Known
from sysid.diagnosis.simulated.part_targets import part_targets
from sysid.diagnosis.simulated.windows import cut_windows

SUBSTEP_S = 0.00025
"""Longest substep of the simulation [s]."""

TARGET_S = 0.001
"""Longest time for which substeps have one target, its mean [s], where a low-pass is
slow against it: the exact path costs more than all else. A servo without one, which may
meet its limit as soon as a target arrives, has a target for each substep."""

SLOW = 12.0
"""How much longer than that a low-pass with the corner ω at least lasts, 2π / ω."""

WINDOW_S = 0.5
"""Length of a window that the logged effort drives [s]."""


BEGIN_ROUNDS = 2
"""Fixed-point steps to where an encoder reads an angle; each leaves the square of the
share by which the encoder's slope is not one."""


def simulated(
    problem: Problem,
    thetas: Float[np.ndarray, "c n"],
    rows: Int[np.ndarray, " m"] | slice = slice(None),
    known: Known | None = None,
) -> Float[np.ndarray, "c m p"]:
    """Encoder angles y of candidates, from measured starts, smoothed as the track is.

        (μ I + J) q̈ = τ + τ_load − b q̇ − F sign q̇,   y = f(q)

    Args:
        problem: the joint's track and coordinates.
        thetas: coordinates of candidates [1].
        rows: steps of the grid that are asked for [steps].
        known: what has been simulated of the same track and rows; it grows.

    Returns:
        y at those steps [rad].

    Source:
        Output error of the same model: L. Ljung, System Identification: Theory for the
        User, 1999, section 4.2; windows: H. G. Bock, Recent Advances in Parameter
        Identification Techniques for O.D.E., 1983 (multiple shooting); integration:
        `envs.actuator.joint`.
    """
    track, known = problem.data.track, Known() if known is None else known
    means, (step, substeps, *_) = _steps(problem)
    walk = step * (substeps // means), means, known.targets
    params = problem.space.values(thetas)[0]
    targets, which = part_targets(track, params, *walk)
    # What others do is carried once for all where it was measured in time. Beside a
    # late candidate, one in time would read another first step: they are apart.
    late = are_acting(params, LATE, len(thetas))

    def batch(program: Program, lanes: np.ndarray, count: int) -> np.ndarray:
        some = thetas[lanes], targets[which[lanes]], bool(late[lanes[0]])
        out = _simulated(*_arguments(problem, program, *some))
        return np.asarray(out)[:count, rows]

    def angles(program: Program, who: np.ndarray, new: np.ndarray) -> np.ndarray:
        batches = [partial(batch, program, *lanes) for lanes in in_lanes(who[new])]
        return np.concatenate(side_by_side(batches))

    calls, order = [], []
    for behind in (False, True):
        some = np.flatnonzero(late == behind)
        for program, acting in programs(problem.space, thetas[some]):
            who = some[acting]
            before = known.angles.setdefault((program, behind), {})
            evaluate = partial(angles, program, who)
            calls.append(partial(remembered, before, thetas[who], evaluate))
            order.append(who)
    found = np.concatenate(side_by_side(calls)).astype(float)
    return found[np.argsort(np.concatenate(order))]


def compile_simulation(
    problem: Problem, program: Program, late: bool, lanes: int
) -> None:
    """Compiles a program, so that `simulated` finds it when it first needs it.

    Args:
        problem: a joint's track and coordinates.
        program: its effects.
        late: whether it is that of readings that are late.
        lanes: number of candidates that it simulates.
    """
    thetas = np.repeat(problem.space.nominal[None], lanes, 0)
    steps, pieces = problem.data.track.cmd.shape
    targets = np.zeros((lanes, steps, _steps(problem)[0], pieces), np.float32)
    _simulated.lower(*_arguments(problem, program, thetas, targets, late)).compile()


def _arguments(
    problem: Problem,
    program: Program,
    thetas: Float[np.ndarray, "c n"],
    targets: Float[np.ndarray, "c t k p"],
    late: bool,
) -> tuple:
    """Returns what `_simulated` takes for candidates."""
    params, nuisance = problem.space.values(thetas)
    acting = {name: params[name] for name in program}
    age = ages(params, problem.data.dt) if late else None
    track, (_, fixed) = problem.data.track, _steps(problem)
    return (track, (targets, age), acting, nuisance, program, *fixed)


def _steps(problem: Problem) -> tuple[int, tuple[float, int, int, bool]]:
    """Returns how many targets a step has, and how `_simulated` divides time."""
    dt, driven = problem.data.dt, problem.known == "mechanics"
    means = _parts(dt, _target_s(problem))
    substeps = means * _parts(dt / means, SUBSTEP_S)
    steps = len(problem.data.track.cmd)
    window = max(round(WINDOW_S / dt), 8) if driven else steps
    return means, (dt / substeps, substeps, window, driven)


def _target_s(problem: Problem) -> float:
    """Returns for how long targets may be averaged [s]."""
    path = problem.space.values(problem.space.nominal[None])[0]["lowpass_cutoff"]
    slow = SLOW * TARGET_S * float(path["cutoff_hz"][0]) < 1.0
    return TARGET_S if slow else SUBSTEP_S


def _parts(whole_s: float, most_s: float) -> int:
    """Returns how many equal parts are short enough; one per cent may be too long."""
    return max(1, int(np.ceil(whole_s / most_s - 0.01)))


@partial(jax.jit, static_argnums=(4, 5, 6, 7, 8))
def _simulated(
    track: Track,
    moved: tuple[Float[Array, "c t k p"], Float[Array, "2 c"] | None],
    params: dict[str, dict[str, Float[Array, " c"]]],
    nuisance: Nuisance,
    program: Program,
    dt: float,
    substeps: int,
    window: int,
    driven: bool,
) -> Float[Array, "c t p"]:
    """Integrates all candidates side by side, on targets and ages of readings."""
    targets, age = moved
    effects = {n: {k: v[None, :] for k, v in params[n].items()} for n in program}
    gain, mass = nuisance.effort_gain[None, :], nuisance.mass[None, :]
    cut = cut_windows(track, jnp.moveaxis(targets, 0, -1), window, dt * substeps)
    effects = cascade.with_cascade(effects, cut.track.cascade, nuisance.k_int[None, :])
    kp, kd = cut.track.kp[:, None], cut.track.kd[:, None]
    enters = {"measured": jnp.asarray(float(driven)), "ripple": jnp.zeros(())}

    def chain(now):
        model = play.with_motor(effects, nuisance, now.inertia, driven)
        return (*model, (ENTER, {**enters, "effort": gain * now.effort}))

    def act(now, target, states, at, qd, away):
        pushed = nuisance.push_gain[None, :]
        around, load = surroundings_at(cut.track, now, away, mass, pushed)
        joint = JointInput(target, at, qd, load, kp, kd, around)
        return chain_step(chain(now), states, joint, dt)

    def substep(carry, there, target):
        (states, q, qd, _), (now, turned) = carry, there
        # Angles at its middle, speeds at its ends, damped by their mean: second order.
        middle = q + 0.5 * dt * qd
        states, x = act(now, target, states, middle, qd, middle - now.pos + turned)
        x = replace(x, damping=0.5 * x.damping * (1.0 - float(driven)))
        _, qd = joint_step(x, mass * now.inertia, dt)
        q = middle + 0.5 * dt * qd
        # The chain read the encoder before the joint moved on.
        return states, q, qd, x.encoder + q - middle

    def placed(now, target, states, anew, *moved):
        def read(at, qd):
            return act(now, target, states, at, qd, at - now.pos)[1]

        return _where_read(now, read, anew, *moved)

    def step(carry, row):
        before, after, target = with_candidates(row[0]), with_candidates(row[1]), row[2]
        before = beside(cut.whole, before, row[4] - 1.0, age)
        after = beside(cut.whole, after, row[4], age)
        states, q, qd, y = carry
        anew = row[3][:, None] > 0.0
        place = partial(placed, before[0], target[0], states, anew)
        q, put = jax.lax.cond(anew.any(), place, lambda *moved: moved, q, qd)
        states, qd = play.begun(states, anew, before[0].vel, (qd, put))
        states = _begun(cut.track, before[0], nuisance, effects, states, anew)

        def within(i, c):
            now = _between(before, after, (i + 0.5) / substeps)
            return substep(c, now, target[i * len(target) // substeps])

        carry = jax.lax.fori_loop(0, substeps, within, (states, q, qd, y))
        return carry, carry[3]

    first = with_candidates(jax.tree.map(lambda v: v[0], cut.before))
    rest = partial(init_states, chain(first), cut.target[0, 0])
    q0, always = jnp.repeat(first.pos, gain.size, 1), jnp.ones((1, 1), bool)
    moving = placed(first, cut.target[0, 0], rest(q0, dt), always, q0, q0)
    start = (rest(moving[0], dt), *moving, q0)
    rows = (cut.before, cut.motion, cut.target, cut.resumed, cut.number)
    return lanes_first(_joined(jax.lax.scan(step, start, rows)[1], track))


def _between(before, after, share):
    """Interpolates what is known at two rows."""
    return jax.tree.map(lambda a, b: a + share * (b - a), before, after)


def _joined(angles: Float[Array, "w l c"], track: Track) -> Float[Array, "t p c"]:
    """Puts windows one behind the other again, and smooths as the track is."""
    steps, pieces = track.pos.shape
    whole = angles.reshape(len(angles), -1, pieces, angles.shape[-1])
    whole = jnp.swapaxes(whole, 0, 1).reshape(-1, pieces, angles.shape[-1])
    return band.smooth(whole[:steps])


def _where_read(
    now: Motion,
    read: Callable[..., Substep],
    anew: Bool[Array, "#l 1"],
    q: Float[Array, "l c"],
    qd: Float[Array, "l c"],
) -> tuple[Float[Array, "l c"], Float[Array, "l c"]]:
    """Puts what begins anew to where, and as fast as, the encoder read it."""
    at, speed = jnp.where(anew, now.pos, q), jnp.where(anew, now.vel, qd)
    for _ in range(BEGIN_ROUNDS):
        x = read(at, speed)
        at = jnp.where(anew, at - (x.encoder - now.pos), at)
        speed = jnp.where(anew, speed - (x.encoder_speed - now.vel), speed)
    return at, speed


def _begun(track: Track, now: Motion, nuisance: Nuisance, effects, states, anew):
    """Gives the integral of a cascade the torque at which the record resumes."""
    if cascade.NAME not in effects:
        return states
    at, mass = list(effects).index(cascade.NAME), nuisance.mass[None, :]
    none = jnp.zeros_like(now.pos * mass)
    load = surroundings_at(track, now, none, mass, nuisance.push_gain[None, :])[1]
    taken = mass * now.inertia * now.acc - load
    logged = track.measured[:, None] > 0.0
    torque = jnp.where(logged, nuisance.effort_gain[None, :] * now.effort, taken)
    anew = anew & (effects[cascade.NAME]["k_int"] > 0.0)
    begun = cascade.begun(states[at], anew, torque)
    return (*states[:at], begun, *states[at + 1 :])
