"""Joints that move along because another one accelerates.

Their servos hold neighbours with finite stiffness, so a joint does not feel the mass
matrix's diagonal but a smaller inertia:

    A x_o + m x = Δt f_o,      A = M_oo + Δt diag(kd_o) / 2
    (M − mᵀ A⁻¹ m) x = Δt (f − mᵀ A⁻¹ f_o)

with speed changes x of the joint and x_o of its neighbours, their servos' torques f_o
and the coupling m = M_oj. Left out, it biases stiffness by up to a tenth. Neighbours
have the gains that the simulation gives them.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.chain import JointInput, chain_step, init_states
from sysid.drive import JointDrive
from sysid.mechanism import Mechanism
from sysid.rigid import interpolated

_COUPLED = 0.02
"""Share of its own inertia from which on a coupling counts."""

_COMMAND = ("lowpass_cutoff", "slew_limit", "transport_delay")


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Coupled joints at every step of a record (m steps, k neighbours).

    Attributes:
        inertia: the joint's own, with its drive's [kg·m²].
        moved: A⁻¹ m, how much neighbours move along.
        rest: M − mᵀ A⁻¹ m without the joint's own inertia, ≤ 0 [kg·m²].
        inverse: A⁻¹ [1/(kg·m²)].
        command: where their servos want to be [rad].
        kp, kd: of their servos.
    """

    inertia: Float[np.ndarray, " m"]
    moved: Float[np.ndarray, "m k"]
    rest: Float[np.ndarray, " m"]
    inverse: Float[np.ndarray, "m k k"]
    command: Float[np.ndarray, "m k"]
    kp: Float[np.ndarray, " k"]
    kd: Float[np.ndarray, " k"]


def neighbours_along(
    mechanism: Mechanism,
    matrices: Float[np.ndarray, "c j j"],
    every: int,
    targets: dict[str, Float[np.ndarray, " m"]],
    joint: str,
    dt: float,
) -> Neighbours:
    """A = M_oo + Δt diag(kd_o) / 2 and A⁻¹ M_oj at every step; see the module.

    Args:
        mechanism: the simulation as it stands.
        matrices: mass matrices of all joints, once in `every` steps [kg·m²].
        every: steps between two matrices.
        targets: targets of all joints at every step [rad].
        joint: whose neighbours.
        dt: step [s].

    Source:
        Ours: block elimination of the neighbours' speeds from the implicit step.
    """
    names = mechanism.joints
    j, steps = names.index(joint), len(targets[joint])
    share = np.max(np.abs(matrices[:, j]), 0) / np.mean(matrices[:, j, j])
    others = [o for o in range(len(names)) if o != j and share[o] > _COUPLED]
    drives = [mechanism.drives[names[o]] for o in others]
    kd = np.array([drive.kd.value for drive in drives])
    coupling = matrices[:, others, j]
    inverse = np.linalg.inv(matrices[:, others][:, :, others] + 0.5 * dt * np.diag(kd))
    moved = np.einsum("tab,tb->ta", inverse, coupling)
    commands = [
        _command(drive, targets[names[o]], dt)
        for o, drive in zip(others, drives, strict=True)
    ]
    rows = every * np.arange(len(matrices))
    own, along, rest, inverse = (
        interpolated(rows, x, steps)
        for x in (matrices[:, j, j], moved, -np.sum(moved * coupling, 1), inverse)
    )
    return Neighbours(
        inertia=own,
        moved=along,
        rest=rest,
        inverse=inverse,
        command=np.stack(commands, 1) if commands else np.zeros((steps, 0)),
        kp=np.array([drive.kp.value for drive in drives]),
        kd=kd,
    )


def _command(
    drive: JointDrive, held: Float[np.ndarray, " m"], dt: float
) -> Float[np.ndarray, " m"]:
    """Command of a servo behind its delay, low-pass and speed limit."""
    if np.ptp(held) == 0.0:
        return held
    model = [
        (
            CATALOGUE[name],
            {k: jnp.asarray(v.value) for k, v in drive.effects[name].items()},
        )
        for name in _COMMAND
        if name in drive.effects
    ]
    none, first = jnp.zeros(()), float(held[0])

    def step(states, target):
        states, x = chain_step(model, states, JointInput(target, none, none), dt)
        return states, x.command

    # Float32 holds 0.1 µrad of a deviation, and none of a multiple of π.
    away = jnp.asarray(held - first, jnp.float32)
    found = jax.lax.scan(step, init_states(model, away[0], none, dt), away)[1]
    return np.asarray(found, dtype=float) + first
