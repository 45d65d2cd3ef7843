"""Closed-loop simulation of one joint along its records: for display.

The candidate follows the targets by itself: chain and joint are integrated from the
measured start of every piece, at substeps of at most a millisecond and a quarter.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.actuator.chain import JointInput, chain_step, init_states
from envs.actuator.joint import joint_step
from sysid.diagnosis.replay.command import command_path
from sysid.diagnosis.replay.effects import KINDS
from sysid.diagnosis.replay.model import Nuisance
from sysid.diagnosis.replay.motion import Track, motion_of, with_candidates
from sysid.diagnosis.replay.surroundings import surroundings_at
from sysid.diagnosis.search.problem import Problem

SUBSTEP_S = 0.00125
"""Longest substep of the simulation [s]."""


def simulated(
    problem: Problem, thetas: Float[np.ndarray, "c n"]
) -> Float[np.ndarray, "c t p"]:
    """Encoder angles y of candidates that follow the targets from a measured start.

        (μ I + J) q̈ = τ + τ_load − b q̇ − F sign q̇,   y = f(q)

    Args:
        problem: the joint's track and coordinates.
        thetas: coordinates of candidates [1].

    Returns:
        y at the steps of the grid [rad].

    Source:
        Output error of the same model, for display: L. Ljung, System Identification:
        Theory for the User, 1999, section 4.2; integration: `envs.actuator.joint`.
    """
    substeps = max(1, int(np.ceil(problem.data.dt / SUBSTEP_S)))
    params, nuisance = problem.space.values(thetas)
    angles = _closed_loop(
        problem.data.track,
        params,
        nuisance,
        problem.data.dt / substeps,
        substeps,
        problem.space.effects,
    )
    return np.moveaxis(np.asarray(angles, float), 2, 0)


@partial(jax.jit, static_argnames=("dt", "substeps", "names"))
def _closed_loop(
    track: Track,
    params: dict[str, dict[str, Float[Array, " c"]]],
    nuisance: Nuisance,
    dt: float,
    substeps: int,
    names: tuple[str, ...],
) -> Float[Array, "t p c"]:
    """Integrates all candidates side by side."""
    path = command_path(track.held, track.sent, params, dt * substeps)[0]
    model = tuple(
        (KINDS[n], {k: v[None, :] for k, v in params[n].items()})
        for n in names
        if n in KINDS
    )
    mass, pushed = nuisance.mass[None, :], nuisance.push_gain[None, :]
    kp, kd = track.kp[:, None], track.kd[:, None]

    def substep(carry, now, target):
        states, q, qd, _ = carry
        around, load = surroundings_at(track, now, q - now.pos, mass, pushed)
        joint = JointInput(target, q, qd, load, kp, kd, around)
        states, x = chain_step(model, states, joint, dt)
        q, qd = joint_step(x, mass * now.inertia, dt)
        return states, q, qd, x.encoder

    def step(carry, row):
        (inner, last), (motion, target) = carry, row
        now = with_candidates(motion)

        def some(i, inner):
            return substep(inner, now, last + (i + 1) / substeps * (target - last))

        inner = jax.lax.fori_loop(0, substeps, some, inner)
        return (inner, target), inner[3]

    motion = motion_of(track)
    pos = motion.pos[0][:, None]
    q0 = jnp.broadcast_to(pos, (pos.shape[0], mass.shape[1]))
    inner = (init_states(model, path[0], q0, dt), q0, jnp.zeros_like(q0), q0)
    return jax.lax.scan(step, (inner, path[0]), (motion, path))[1]
