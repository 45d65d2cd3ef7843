"""Closed-loop simulation of one joint along its records: what the user sees.

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
from envs.actuator.surroundings import Gravity, Surroundings
from sysid.diagnosis.replay.command import command_path
from sysid.diagnosis.replay.residuals import KINDS, Track
from sysid.diagnosis.search.problem import Problem

SUBSTEP_S = 0.00125
_ROWS = (
    "pos",
    "push",
    "ext",
    "inertia",
    "moment",
    "turned",
    "payload_moment",
    "payload_shift",
    "payload_inertia",
    "others_nm",
    "other_q",
    "other_nm",
)


def simulated(
    problem: Problem, thetas: Float[np.ndarray, "c n"]
) -> Float[np.ndarray, "c t p"]:
    """Returns the encoder angles of candidates at the steps of the grid."""
    substeps = max(1, int(np.ceil(problem.data.dt / SUBSTEP_S)))
    params, nuisance = problem.space.values(thetas)
    angles = _closed_loop(
        problem.data.track,
        params,
        nuisance["mass"],
        nuisance["push_gain"],
        problem.data.dt / substeps,
        substeps,
        problem.space.effects,
    )
    return np.moveaxis(np.asarray(angles, float), 2, 0)


@partial(jax.jit, static_argnames=("dt", "substeps", "names"))
def _closed_loop(
    track: Track,
    params: dict[str, dict[str, Float[Array, " c"]]],
    mass: Float[Array, " c"],
    pushed: Float[Array, " c"],
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
    mass, pushed = mass[None, :], pushed[None, :]
    kp, kd = track.kp[:, None], track.kd[:, None]

    def substep(carry, now, target):
        states, q, qd, _ = carry
        away = q - now["pos"]
        moment = mass[..., None] * (
            jnp.cos(away)[..., None] * now["moment"]
            + jnp.sin(away)[..., None] * now["turned"]
        )
        gravity = jnp.broadcast_to(track.gravity[:, None], moment.shape)
        load = now["push"] + pushed * now["ext"] + jnp.sum(moment * gravity, -1)
        around = Surroundings(
            others_nm=now["others_nm"],
            other_q=now["other_q"],
            other_nm=now["other_nm"],
            gravity=Gravity(
                gravity=gravity,
                moment=moment,
                payload_kg=jnp.broadcast_to(track.payload_kg[:, None], q.shape),
                payload_moment=now["payload_moment"],
                payload_shift=now["payload_shift"],
                payload_inertia=now["payload_inertia"],
            ),
        )
        joint = JointInput(target, q, qd, load, kp, kd, around)
        states, x = chain_step(model, states, joint, dt)
        q, qd = joint_step(x, mass * now["inertia"], dt)
        return states, q, qd, x.encoder

    def step(carry, row):
        inner, last = carry
        row, target = row
        now = {k: v[:, None] for k, v in row.items()}

        def some(i, inner):
            return substep(inner, now, last + (i + 1) / substeps * (target - last))

        inner = jax.lax.fori_loop(0, substeps, some, inner)
        return (inner, target), inner[3]

    rows = {k: getattr(track, k) for k in _ROWS}
    first = {k: v[0][:, None] for k, v in rows.items()}
    q0 = jnp.broadcast_to(first["pos"], (first["pos"].shape[0], mass.shape[1]))
    inner = (init_states(model, path[0], q0, dt), q0, jnp.zeros_like(q0), q0)
    return jax.lax.scan(step, (inner, path[0]), (rows, path))[1]
