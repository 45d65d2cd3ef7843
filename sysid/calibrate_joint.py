"""Stiffness, damping, delay, cutoff and speed of one joint from its trajectory.

The joint is simulated on the recorded targets and its figures are moved until the
trajectory (and the effort, where it was logged) agree:

    θ̂ = argmin Σ_channels ‖(y − ŷ(θ)) / s‖² + ‖(θ − θ₀) / σ‖²

Dry and viscous friction and the inertia are fitted along, so that they bend nothing.
Errors of one second belong together, whatever their colour: intervals come from the
scatter of the gradient between blocks (sandwich estimator) and Student's t.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.stats import t as student

from envs.errors import InputError
from envs.hand.effects.catalogue import CATALOGUE
from envs.hand.effects.chain import chain_step, init_states
from envs.hand.effects.joint import joint_step
from sysid.calibrate_record import STEP_S, Record, joint_record
from sysid.data import MeasuredLog
from sysid.mechanism import JointDrive, Mechanism

FIGURES = ("stiffness", "damping", "delay_s", "lowpass_hz", "speed_limit")
"""What is reported; inertia and both frictions are fitted along."""

_DEVIATION = np.array([2.0, 2.0, 1.5, 1.5, 2.0, 0.05, 1.0, 1.0])
"""Of the priors: of logarithms, of frictions in units of the largest torque."""

_FLOOR = np.array([0.005, 0.005, 0.015, 0.003, 0.001])
"""Deviations of the reported logarithms below which nothing is believed: step size,
and what a rigid joint leaves out."""

_STEP, _ROUNDS, _BLOCK_S = 0.01, 20, 1.0
_FRICTION = slice(6, 8)
_NO_SPEED_LIMIT = 100.0


@dataclass(frozen=True, eq=False)
class JointFit:
    """What was found for one joint.

    Attributes:
        joint: its name.
        values, low, high: by name in `FIGURES`; gains as factors of the drive's; NaN
            bounds for what the record does not show.
        rms: error of every channel, `pos` and, if logged, the effort.
        records: what was measured.
        simulated: what the fit gives for it, records of rows by (angle, effort).
    """

    joint: str
    values: dict[str, float]
    low: dict[str, float]
    high: dict[str, float]
    rms: dict[str, float]
    records: tuple[Record, ...]
    simulated: tuple[Float[np.ndarray, "n 2"], ...]

    def deviation(self, name: str) -> float:
        """Returns half the interval's width over 1.96, in the figure's unit."""
        return (self.high[name] - self.low[name]) / (2.0 * 1.96)


def fit_joint(
    mechanism: Mechanism, logs: Sequence[MeasuredLog], joint: str
) -> JointFit:
    """Fits one joint.

    Raises:
        InputError: the joint does not move in any record.
    """
    records = tuple(joint_record(mechanism, log, joint) for log in logs)
    if max(np.ptp(r.held) for r in records) < 1e-3:
        valid = "targets that move the joint"
        raise InputError(logs[0].source, f"cmd.{joint}", "no motion", valid)
    problem = _Problem(mechanism.drives[joint], records)
    theta = problem.fitted(problem.best_start())
    # Once more with channels weighed by what they really scatter.
    problem.weigh(problem.residuals(theta[None])[0])
    theta = problem.fitted(theta)
    return _result(problem, theta, joint)


class _Problem:
    """Residuals of one joint as a function of θ."""

    def __init__(self, drive: JointDrive, records: Sequence[Record]):
        self.drive, self.records = drive, records
        self.center = _nominal(drive)
        self.torque = max(float(np.max(np.abs(r.load))) for r in records)
        self.torque = max(self.torque, 0.01 * drive.kp.value)
        self.scales = [np.array([1e-3, max(0.02 * self.torque, 1e-3)]) for _ in records]

    def simulate(self, thetas: Float[np.ndarray, "c 8"]) -> list[np.ndarray]:
        """Angles and efforts of candidates at the rows of every record."""
        limit = self.drive.effects.get("torque_limit", {}).get("limit_nm")
        figures = (
            self.drive.kp.value,
            self.drive.kd.value,
            limit.value if limit else 1e6,
            self.torque,
        )
        found = []
        for r in self.records:
            inputs = tuple(
                jnp.asarray(x, jnp.float32)
                for x in (r.held, r.load, r.load_slope, r.angle)
            )
            out = _simulate(
                jnp.asarray(thetas, jnp.float32), inputs, figures, r.inertia
            )
            found.append(r.at_rows(np.asarray(out, dtype=float)))
        return found

    def residuals(self, thetas: Float[np.ndarray, "c 8"]) -> Float[np.ndarray, "c n"]:
        """Weighted residuals, all records one after the other."""
        parts = []
        for r, y, scale in zip(
            self.records, self.simulate(thetas), self.scales, strict=True
        ):
            rest = np.where(r.valid, np.nan_to_num(r.measured) - y, 0.0) / scale
            parts.append(rest.reshape(len(thetas), -1))
        return np.nan_to_num(np.concatenate(parts, 1), nan=1e3, posinf=1e3, neginf=-1e3)

    def weigh(self, residual: Float[np.ndarray, " n"]) -> None:
        """Takes the scatter of a fit as the scatter of the channels."""
        first = 0
        for i, r in enumerate(self.records):
            rest = residual[first : first + r.valid.size].reshape(r.valid.shape)
            first += r.valid.size
            count = np.maximum(r.valid.sum(0), 1)
            self.scales[i] = self.scales[i] * np.sqrt(np.sum(rest**2, 0) / count)
            self.scales[i] = np.maximum(self.scales[i], 1e-6)

    def cost(self, theta: np.ndarray, residual: np.ndarray) -> float:
        """Value that is minimized."""
        prior = (theta - self.center) / _DEVIATION
        return float(residual @ residual + prior @ prior)

    def best_start(self) -> Float[np.ndarray, " 8"]:
        """Tries gains over two decades with three delays and cutoffs."""
        grid = []
        for gain in np.log([0.1, 0.3, 1.0, 3.0, 10.0]):
            for late in np.log([0.3, 1.0]):
                for cutoff in np.log([0.5, 1.0, 2.0]):
                    shift = np.array([gain, 0.5 * gain, late, cutoff, 0, 0, 0, 0])
                    grid.append(self.center + shift)
        thetas = np.array(grid)
        costs = np.sum(np.clip(self.residuals(thetas), -30.0, 30.0) ** 2, 1)
        return thetas[int(np.argmin(costs))]

    def linear(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual and its Jacobian by central differences."""
        step = _STEP * np.eye(len(theta))
        both = self.residuals(np.concatenate([theta[None], theta + step, theta - step]))
        n = len(theta)
        return both[0], (both[1 : n + 1] - both[n + 1 :]).T / (2.0 * _STEP)

    def fitted(self, theta: np.ndarray) -> Float[np.ndarray, " 8"]:
        """Levenberg-Marquardt; frictions stay ≥ 0."""
        damping = 1e-3
        for _ in range(_ROUNDS):
            r, jac = self.linear(theta)
            gram = jac.T @ jac + np.diag(_DEVIATION**-2.0)
            slope = jac.T @ r + (theta - self.center) / _DEVIATION**2
            tries = damping * np.array([0.1, 1.0, 30.0, 1e3])
            steps = [
                np.linalg.solve(gram + d * np.diag(np.diag(gram)), -slope)
                for d in tries
            ]
            thetas = self.inside(theta + np.clip(steps, -1.0, 1.0))
            found = self.residuals(thetas)
            costs = [self.cost(x, y) for x, y in zip(thetas, found, strict=True)]
            best = int(np.argmin(costs))
            gain = self.cost(theta, r) - costs[best]
            if gain <= 0.0:
                damping *= 1e3
                if damping > 1e6:
                    break
                continue
            theta, damping = thetas[best], max(float(tries[best]), 1e-7)
            if gain < 0.02:
                break
        return theta

    def inside(self, thetas: np.ndarray) -> np.ndarray:
        """Keeps frictions from changing sign and delays inside the delay line."""
        thetas = np.array(thetas)
        thetas[:, _FRICTION] = np.maximum(thetas[:, _FRICTION], 0.0)
        thetas[:, 2] = np.minimum(thetas[:, 2], np.log(0.095))
        return thetas


def _nominal(drive: JointDrive) -> Float[np.ndarray, " 8"]:
    """θ of the drive as simulated so far."""

    def figure(effect: str, name: str, default: float) -> float:
        found = drive.effects.get(effect, {}).get(name)
        return found.value if found else default

    delay = max(figure("transport_delay", "delay_s", 0.01), 1e-3)
    cutoff = figure("lowpass_cutoff", "cutoff_hz", 20.0)
    speed = figure("slew_limit", "speed_rad_s", _NO_SPEED_LIMIT)
    return np.array(
        [0.0, 0.0, np.log(delay), np.log(cutoff), np.log(speed), 0.0, 0.0, 0.0]
    )


@jax.jit
def _simulate(thetas, inputs, figures, inertia):
    """Simulates candidates; returns (candidates, steps, angle and effort)."""
    kp, kd, limit, torque = figures
    names = (
        "transport_delay",
        "lowpass_cutoff",
        "slew_limit",
        "torque_limit",
        "coulomb_friction",
        "viscous_friction",
    )

    def single(theta):
        values = (
            {"delay_s": jnp.exp(theta[2])},
            {"cutoff_hz": jnp.exp(theta[3])},
            {"speed_rad_s": jnp.exp(theta[4])},
            {"limit_nm": limit},
            {"torque_nm": torque * jnp.maximum(theta[6], 0.0)},
            {"damping_nms": kd * jnp.maximum(theta[7], 0.0)},
        )
        pairs = zip(names, values, strict=True)
        model = [(CATALOGUE[name], value) for name, value in pairs]
        gains = (kp * jnp.exp(theta[0]), kd * jnp.exp(theta[1]))
        body = inertia * jnp.exp(theta[5])

        def step(carry, now):
            states, q, v = carry
            target, load, slope, about = now
            load = load + slope * (q - about)
            states, x = chain_step(model, states, target, q, v, load, *gains, STEP_S)
            # Speeds stand between the angles: half the implicit damping takes the
            # drive's at the angle, which is right to second order in the step.
            half = 0.5 * x.damping
            q, after = joint_step(replace(x, damping=half), body, STEP_S)
            effort = x.effort - half * (after - v)
            return (states, q, after), jnp.stack([x.reading, effort])

        start = (init_states(model, inputs[0][0], inputs[3][0], STEP_S),)
        carry = (*start, inputs[3][0], jnp.zeros(()))
        return jax.lax.scan(step, carry, inputs)[1]

    return jax.lax.map(single, thetas, batch_size=8)


def _result(problem: _Problem, theta: np.ndarray, joint: str) -> JointFit:
    """Values with intervals from the scatter between blocks."""
    r, jac = problem.linear(theta)
    gram = np.linalg.inv(jac.T @ jac + np.diag(_DEVIATION**-2.0))
    blocks = _blocks(problem.records)
    count = int(blocks.max()) + 1
    scores = np.zeros((count, len(theta)))
    np.add.at(scores, blocks, jac * r[:, None])
    meat = scores.T @ scores * count / max(count - 1, 1)
    deviation = np.sqrt(np.diag(gram @ meat @ gram))
    wide = float(student.ppf(0.975, max(count - len(theta), 1)))
    seen = np.sqrt(np.sum(jac**2, 0)) > 1.0
    factors = np.exp(theta[:5])
    values, low, high = {}, {}, {}
    for i, name in enumerate(FIGURES):
        values[name] = float(factors[i])
        spread = wide * np.hypot(deviation[i], _FLOOR[i]) if seen[i] else np.nan
        low[name] = float(factors[i] * np.exp(-spread))
        high[name] = float(factors[i] * np.exp(spread))
    simulated = [y[0] for y in problem.simulate(theta[None])]
    return JointFit(
        joint, values, low, high, _rms(problem, simulated), (*problem.records,),
        tuple(simulated),
    )  # fmt: skip


def _blocks(records: Sequence[Record]) -> np.ndarray:
    """Number of the block of every residual, both channels of a second together."""
    parts, first = [], 0
    for r in records:
        number = first + (r.t_s // _BLOCK_S).astype(int)
        first = int(number.max()) + 1
        parts.append(np.repeat(number, r.valid.shape[1]))
    return np.concatenate(parts)


def _rms(problem: _Problem, simulated: list[np.ndarray]) -> dict[str, float]:
    """Errors of both channels over all records."""
    rest = [r.measured - y for r, y in zip(problem.records, simulated, strict=True)]
    valid = np.concatenate([r.valid for r in problem.records])
    all_rest = np.concatenate(rest)
    return {
        name: float(np.sqrt(np.mean(all_rest[valid[:, i], i] ** 2)))
        for i, name in enumerate(("pos", "effort"))
        if np.any(valid[:, i])
    }
