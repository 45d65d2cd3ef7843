"""One joint along the way that a plan takes it, simulated with candidates' effects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.chain import JointInput, chain_step, init_states
from envs.actuator.joint import joint_step
from envs.actuator.surroundings import Surroundings
from sysid.excitation.check import STEP_S
from sysid.excitation.plan import Plan
from sysid.mechanism import Mechanism
from sysid.rigid import at_rest, bodies_along

SETTLE_ROWS = 100
"""Rows at the first targets before the record begins: what an effect does at rest."""


@dataclass(frozen=True, eq=False)
class JointBench:
    """The rigid bodies around one joint, row by row.

    Attributes:
        targets: at every row [rad].
        weight: torque of gravity [N·m].
        stiffness: its change with the angle [N·m/rad].
        around: gravity and the neighbour at every row.
        inertia: of the joint [kg·m²].
        kp, kd: gains.
        repeat: substeps of a row.
    """

    targets: Float[np.ndarray, " n"]
    weight: Float[np.ndarray, " n"]
    stiffness: Float[np.ndarray, " n"]
    around: Surroundings
    inertia: float
    kp: float
    kd: float
    repeat: int

    def simulate(
        self, candidates: Sequence[Mapping[str, Mapping[str, float]]]
    ) -> Float[np.ndarray, "c n 2"]:
        """M q̈ = τ(servo, effects) + m · g, read by the encoder and as effort.

        Args:
            candidates: parameters by effect and name, the same effects in all of them.

        Returns:
            Reading [rad] and effort [N·m] of every candidate at every row.

        Source:
            The chain of `envs.actuator`; bodies are frozen along the targets (ours).
        """
        names = tuple(candidates[0])
        stacked = jax.tree.map(lambda *x: jnp.asarray(x, jnp.float32), *candidates)
        rows = (self.targets, self.weight, self.stiffness, self.around)
        rows = jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), rows)
        drive = (self.inertia, self.kp, self.kd)
        return np.asarray(_run(names, self.repeat, stacked, rows, drive), dtype=float)


def joint_bench(mechanism: Mechanism, plan: Plan, joint: str) -> JointBench:
    """Freezes the rigid bodies along the first repeat of the joint's waves."""
    j = plan.joints.index(joint)
    rows = np.zeros(len(plan.targets), dtype=bool)
    for segment in plan.segments:
        if joint in segment.joints and not segment.repeat:
            start, stop = segment.start_s * plan.rate_hz, segment.stop_s * plan.rate_hz
            rows[round(start) : round(stop)] = True
    targets, drive = plan.targets[rows], mechanism.drives[joint]
    pull = mechanism.model.opt.gravity
    bodies = bodies_along(mechanism, plan.joints, at_rest(targets), pull)
    other = j + 1 if j + 1 < targets.shape[1] else j - 1
    beside = targets[:, other] if other >= 0 else np.zeros(len(targets))
    around = Surroundings(
        other_q=jnp.asarray(beside),
        other_nm=jnp.zeros(len(targets)),
        gravity=bodies.gravity_on(j),
    )
    return JointBench(
        targets=targets[:, j],
        weight=bodies.weight[:, j],
        stiffness=bodies.weight_slope[:, j],
        around=around,
        inertia=float(np.mean(bodies.inertia[:, j])),
        kp=drive.kp.value,
        kd=drive.kd.value,
        repeat=max(round(1.0 / plan.rate_hz / STEP_S), 1),
    )


@partial(jax.jit, static_argnames=("names", "repeat"))
def _run(names, repeat, stacked, rows, drive):
    """Simulates candidates; targets and surroundings are held over the substeps."""
    inertia, kp, kd = drive

    def single(parameters):
        model = [(CATALOGUE[name], parameters[name]) for name in names]

        def substep(carry, now):
            states, q, v, _ = carry
            target, load, stiffness, around = now
            load = load + stiffness * (q - target)
            joint = JointInput(target, q, v, load, kp, kd, around)
            states, x = chain_step(model, states, joint, STEP_S)
            q, v = joint_step(x, inertia, STEP_S)
            return states, q, v, jnp.stack([x.reading, x.effort])

        def row(carry, now):
            carry = jax.lax.fori_loop(0, repeat, lambda _, c: substep(c, now), carry)
            return carry, carry[-1]

        start = rows[0][0]
        states = init_states(model, start, start, STEP_S)
        carry = (states, start, jnp.zeros(()), jnp.zeros(2))
        first = jax.tree.map(lambda x: x[0], rows)
        carry = jax.lax.fori_loop(0, SETTLE_ROWS, lambda _, c: row(c, first)[0], carry)
        return jax.lax.scan(row, carry, rows)[1]

    return jax.lax.map(single, stacked, batch_size=8)
