"""One joint simulated on its recorded targets.

Stiffness, damping, delay, cutoff and speed limit are the servo's; inertia, weight, dry
and viscous friction say what the servo works against. All of them are factors or
values whose logarithms are searched, but for the frictions.
"""

from collections.abc import Sequence
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.chain import JointInput, chain_step, init_states
from envs.actuator.joint import joint_step
from sysid.calibration.record import BLOCK_S, STEP_S, Record

SERVO = slice(0, 5)
"""Parameters of the servo; after them inertia, weight, dry and viscous friction."""

# The delay comes after the low-pass: it may, for the path is the same at all times, and
# between two steps a smooth command can be read where a jump cannot.
_NAMES = (
    "lowpass_cutoff",
    "transport_delay",
    "slew_limit",
    "torque_limit",
    "coulomb_friction",
    "viscous_friction",
)


class Motion:
    """Residual of the simulated angle and effort of one joint."""

    def __init__(
        self, records: Sequence[Record], gains: tuple[float, float], limit_nm: float
    ):
        self.records, self.gains, self.limit = records, gains, limit_nm
        torque = max(float(np.max(np.abs(r.load))) for r in records)
        self.torque = max(torque, 0.01 * gains[0])
        self.scales = [np.array([1e-3, max(0.02 * self.torque, 1e-3)]) for _ in records]

    def _steps(
        self, thetas: Float[np.ndarray, "c 9"]
    ) -> list[Float[np.ndarray, "c m 2"]]:
        """Angles and efforts of candidates at the steps of every record."""
        drive = (*self.gains, self.limit, self.torque)
        found = []
        for r in self.records:
            n = r.neighbours
            own = (r.held, r.load, r.load_slope, r.angle, n.inertia)
            along = (n.moved, n.rest, n.inverse, n.command)
            inputs = [jnp.asarray(x, jnp.float32) for x in (*own, *along)]
            out = _simulate(
                jnp.asarray(thetas, jnp.float32), inputs, drive, (n.kp, n.kd)
            )
            found.append(np.asarray(out, dtype=float))
        return found

    def simulate(
        self, thetas: Float[np.ndarray, "c 9"]
    ) -> list[Float[np.ndarray, "c n 2"]]:
        """I q̈ = τ(target, q, q̇) + w m · g − friction, at the rows of every record.

        Args:
            thetas: logarithms of the factors of stiffness and damping, of delay [s],
                cutoff [Hz] and speed limit [rad/s], of the factors of inertia and
                weight w; dry friction over the largest torque of gravity and viscous
                friction over the velocity gain [1].

        Returns:
            Angle [rad] and effort [N·m] of every candidate, record by record.

        Source:
            *Fingers as Legs*, the calibration of Table I; the neighbours are ours.
        """
        pairs = zip(self.records, self._steps(thetas), strict=True)
        return [record.at_rows(steps) for record, steps in pairs]

    def residuals(self, thetas: Float[np.ndarray, "c 9"]) -> Float[np.ndarray, "c n"]:
        """R = (y − ŷ(θ)) / s of every valid reading, all records one after the other.

        Args:
            thetas: candidates, see `simulate` [1].

        Returns:
            Residuals in units of the scatter s [1]; 0 where nothing was read.

        Source:
            Ours: the output error of one joint on its recorded targets.
        """
        parts = []
        simulated = self.simulate(thetas)
        for r, y, scale in zip(self.records, simulated, self.scales, strict=True):
            rest = np.where(r.valid, np.nan_to_num(r.measured) - y, 0.0) / scale
            parts.append(rest.reshape(len(thetas), -1))
        return np.nan_to_num(np.concatenate(parts, 1), nan=1e3, posinf=1e3, neginf=-1e3)

    def weigh(self, residual: Float[np.ndarray, " n"]) -> None:
        """S ← s √(mean r²) of every channel: a fit's scatter is that of the readings.

        Args:
            residual: r of the fit, as from `residuals` [1].

        Source:
            Textbook iteratively reweighted least squares.
        """
        first = 0
        for i, r in enumerate(self.records):
            rest = residual[first : first + r.valid.size].reshape(r.valid.shape)
            first += r.valid.size
            count = np.maximum(r.valid.sum(0), 1)
            factor = np.sqrt(np.sum(rest**2, 0) / count)
            self.scales[i] = self.scales[i] * np.maximum(factor, 1e-6)

    def blocks(self) -> Int[np.ndarray, " n"]:
        """B = ⌊t / 1 s⌋, the block of every residual, counted through all records [1].

        Source:
            Ours: errors of one second belong together, whatever their colour.
        """
        parts, first = [], 0
        for r in self.records:
            number = first + (r.t_s // BLOCK_S).astype(int)
            first = int(number.max()) + 1
            parts.append(np.repeat(number, r.valid.shape[1]))
        return np.concatenate(parts)


@jax.jit
def _simulate(thetas, inputs, drive, held_by):
    """Simulates candidates; returns (candidates, steps, angle and effort)."""
    kp, kd, limit, torque = drive

    def single(theta):
        values = (
            {"cutoff_hz": jnp.exp(theta[3])},
            {"delay_s": jnp.exp(theta[2])},
            {"speed_rad_s": jnp.exp(theta[4])},
            {"limit_nm": limit},
            {"torque_nm": torque * jnp.maximum(theta[7], 0.0)},
            {"damping_nms": kd * jnp.maximum(theta[8], 0.0)},
        )
        pairs = zip(_NAMES, values, strict=True)
        model = [(CATALOGUE[name], value) for name, value in pairs]
        gains = (kp * jnp.exp(theta[0]), kd * jnp.exp(theta[1]))
        heavy, weight = jnp.exp(theta[5]), jnp.exp(theta[6])

        def step(carry, now):
            states, q, v, others, speeds = carry
            target, load, slope, about, inertia, moved, rest, inverse, command = now
            push = held_by[0] * (command - others) - held_by[1] * speeds
            load = weight * (load + slope * (q - about)) - moved @ push
            joint = JointInput(target, q, v, load, *gains)
            states, x = chain_step(model, states, joint, STEP_S)
            # Speeds stand between the angles: half the implicit damping takes the
            # drive's at the angle, which is right to second order in the step.
            half = 0.5 * x.damping
            body = heavy * inertia + rest
            q, after = joint_step(replace(x, damping=half), body, STEP_S)
            effort = x.effort - half * (after - v)
            speeds = speeds + STEP_S * inverse @ push - moved * (after - v)
            others = others + STEP_S * speeds
            read = jnp.stack([x.reading, effort])
            return (states, q, after, others, speeds), read

        states = init_states(model, inputs[0][0], inputs[3][0], STEP_S)
        others = inputs[-1][0]
        carry = (states, inputs[3][0], jnp.zeros(()), others, jnp.zeros_like(others))
        return jax.lax.scan(step, carry, inputs)[1]

    return jax.lax.map(single, thetas, batch_size=8)
