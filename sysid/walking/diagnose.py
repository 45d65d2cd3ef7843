"""Names what is wrong with a hand that walks, from a minute of its log.

    diagnosis = diagnose_walk(read_log("walk.parquet"), env)

Every hypothesis of `sysid.walking.hypotheses` is fitted on half of the walk, in
stretches of five seconds, and judged on the other half, and the other way round:

    r = [short walks missed, gyro − turning − b, R g − down(tilt)] / scatter

First all along the tangent at the hand as simulated, then the best few in full. The
friction of the fingertips is fitted along in all of them.
"""

import time
from collections.abc import Callable, Iterator, Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from envs.actuator.effects.mount_tilt import tilted
from envs.batch import BatchEnv
from sysid.least_squares import Fit, Task, fit_all, standard_errors
from sysid.least_squares.newton import gauss_newton
from sysid.logs.log import MeasuredLog
from sysid.result import Diagnosis
from sysid.walking.hypotheses import Hypothesis, axes, candidate, hypotheses
from sysid.walking.record import walk_record
from sysid.walking.simulation import PIECE_STEPS, Pieces
from sysid.walking.verdict import BOUND, Judged, verdict_of

STRETCH_S = 5.0
FULL = 3
"""Hypotheses that are fitted in full."""

_PRIOR, _STEP, _ROBUST = 10.0, 1.0, 3.0
_ROUNDS = 16

_FLOOR = 0.3
"""Deviation of parameters, in units of their axes, below which nothing is
believed: short walks start from measured states, whose noise and smoothing bias
what they show (found on walks with known causes)."""

_MEASURED = "floor_tilt"
"""Effect that IMU and camera measure together, without any simulation or slope."""


class Walk:
    """Residual of a walk as a function of all parameters.

    Attributes:
        axes: the parameters (a).
        pieces: short walks (p), each compared in w channels.
        block: number of the stretch that every residual belongs to.
    """

    def __init__(self, log: MeasuredLog, env: BatchEnv):
        self.axes = axes()
        self.pieces = Pieces(env, walk_record(log, env))
        record = self.pieces.record
        rows = self.pieces.starts[:, None] + np.arange(PIECE_STEPS)
        self._spin = np.mean((record.gyro - record.turning)[rows], 1)
        self._down = np.mean(_turned(record.qpos[:, 3:7], record.gravity)[rows], 1)
        raw = self._raw(np.zeros(len(self.axes)))
        self._scale = np.maximum(_scatter(raw), 1e-6)
        stretch = (self.pieces.starts * record.dt // STRETCH_S).astype(int)
        self.block: Int[np.ndarray, " r"] = np.repeat(stretch, raw.shape[1])

    def _raw(self, theta: Float[np.ndarray, " a"]) -> Float[np.ndarray, "p w"]:
        """Residuals in their own units."""
        missed = self.pieces.misses(candidate(theta, self.axes))
        values = {
            (a.effect, a.name): a.value(float(x))
            for a, x in zip(self.axes, theta, strict=True)
        }
        bias = [values["imu_bias", f"{a}_rad_s"] for a in "xyz"]
        tilt = [values["floor_tilt", f"{a}_rad"] for a in ("roll", "pitch")]
        down = np.asarray(tilted(jnp.array([0.0, 0.0, -1.0]), *tilt))
        imu = [self._spin - bias, (self._down - down)[:, :2]]
        return np.concatenate([missed.reshape(len(missed), -1), *imu], 1)

    def residuals(self, thetas: Float[np.ndarray, "c a"]) -> Float[np.ndarray, "c r"]:
        """ρ asinh(y / (s ρ)): linear where small, slowly growing where large.

        Args:
            thetas: parameters of candidates, in units of their axes [1].

        Returns:
            Residuals y of all pieces over their scatter s [1]; ρ = 3.

        Source:
            Ours: a fall of the hand in a few pieces must not outweigh all others.
        """
        scaled = [self._raw(theta) / self._scale / _ROBUST for theta in thetas]
        return np.stack([_ROBUST * np.arcsinh(x).ravel() for x in scaled])

    def fit(
        self, free: tuple[int, ...], start: Float[np.ndarray, " k"], rounds: int
    ) -> Fit:
        """θ̂ = argmin ‖r(θ)‖² + ‖θ / σ‖² over some parameters; the others stay at zero.

        Args:
            free: indices of the parameters.
            start: their first values, in units of their axes [1].
            rounds: Levenberg-Marquardt steps; 0 for the tangent at the start.

        Source:
            Ours; the solver is `sysid.least_squares.fit_all`.
        """
        at = np.zeros(len(self.axes))
        at[list(free)] = start
        same = np.ones(len(at))
        task = Task(
            start=at,
            free=np.array(free),
            center=0.0 * same,
            deviation=_PRIOR * same,
            low=-BOUND * same,
            high=BOUND * same,
            steps=_STEP * same,
            central=True,
        )
        return fit_all(self.residuals, [task], rounds)[0]


def diagnose_walk(
    log: MeasuredLog,
    env: BatchEnv,
    report: Callable[[str], object] = lambda text: None,
) -> tuple[Diagnosis, list[Judged]]:
    """Compares a walk with the simulation and names the cause of the difference.

    Args:
        log: of a free hand; see `sysid.walking.record.walk_record`.
        env: worlds of a task with the hand of `sysid.walking.hypotheses.whole_hand`.
        report: is called with what is being done.

    Returns:
        The verdict, and the hypotheses that were fitted in full, best first.

    Raises:
        InputError: a log that cannot be used, in one sentence.
    """
    began = time.monotonic()
    report("simulating the hand as it is")
    walk = Walk(log, env)
    count = len(walk.axes)
    tangent = walk.fit(tuple(range(count)), np.zeros(count), rounds=0)
    gains = {h: _linear_gains(walk, tangent, h) for h in hypotheses(walk.axes)}
    ranked = sorted(gains, key=lambda h: -np.sum(gains[h]))
    plain = _judged(walk, Hypothesis("", "", ()), 0.0, np.zeros(1))
    full = []
    for hypothesis in ranked[:FULL]:
        report(f"fitting {hypothesis.effect} of {hypothesis.where}")
        start = _half_step(tangent, (0, *hypothesis.indices))
        full.append(_judged(walk, hypothesis, plain.gains, start))
    full.sort(key=lambda judged: -judged.gain)
    found = verdict_of(walk.axes, full, plain, np.bincount(walk.block))
    seconds = round(time.monotonic() - began, 3)
    return Diagnosis(**found, log_sha256=(log.sha256,), seed=0, runtime_s=seconds), full


def _halves(block: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yields the residuals of one half of the walk and the stretches of the other."""
    stretches = np.arange(int(block.max()) + 1)
    for side in (0, 1):
        yield block % 2 == side, stretches % 2 != side


def _linear_gains(walk: Walk, tangent: Fit, hypothesis: Hypothesis) -> np.ndarray:
    """Held-out gains by stretch of a fit along the tangent."""
    gains = np.zeros(int(walk.block.max()) + 1)
    for fit, held in _halves(walk.block):
        costs = []
        for free in ((0,), (0, *hypothesis.indices)):
            step = _half_step(tangent, free, fit)
            residual = tangent.residual + tangent.jacobian[:, list(free)] @ step
            costs.append(_costs(residual, walk.block))
        gains[held] = 0.5 * (costs[0] - costs[1])[held]
    return gains


def _judged(
    walk: Walk,
    hypothesis: Hypothesis,
    plain: Float[np.ndarray, " b"] | float,
    start: Float[np.ndarray, " k"],
) -> Judged:
    """Fits in full; without a hypothesis the gains are minus the plain costs.

    The fits of either half take the Jacobian of the fit of the whole, from which they
    are not far.
    """
    fit = walk.fit((0, *hypothesis.indices), start, _ROUNDS)
    gains = np.zeros(int(walk.block.max()) + 1)
    for fitted, held in _halves(walk.block):
        half = fit.theta.copy()
        half[fit.free] += _half_step(fit, range(len(fit.free)), fitted)
        gains[held] = -0.5 * _costs(walk.residuals(half[None])[0], walk.block)[held]
    errors, wide = standard_errors(fit, np.full(len(fit.theta), _PRIOR), walk.block)
    measured = [walk.axes[i].effect == _MEASURED for i in fit.free]
    half = np.zeros(len(fit.theta))
    half[fit.free] = wide * np.hypot(errors, np.where(measured, 0.0, _FLOOR))
    return Judged(hypothesis, gains - plain, fit.theta, half)


def _half_step(
    fit: Fit, columns: Sequence[int], rows: Bool[np.ndarray, " r"] | None = None
) -> Float[np.ndarray, " k"]:
    """Step of some free parameters to the least squares of some residuals."""
    chosen = slice(None) if rows is None else rows
    jacobian = fit.jacobian[:, list(columns)][chosen]
    away = fit.theta[fit.free[list(columns)]]
    prior = np.full(len(away), _PRIOR)
    return gauss_newton(jacobian, fit.residual[chosen], away, prior)


def _costs(residual: np.ndarray, block: Int[np.ndarray, " r"]) -> np.ndarray:
    """Sum of squares by stretch."""
    return np.bincount(block, residual**2)


def _scatter(raw: np.ndarray) -> np.ndarray:
    """Robust deviation of every channel around its median."""
    return 1.4826 * np.median(np.abs(raw - np.median(raw, axis=0)), axis=0)


def _turned(quat: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Vectors of the palm frame in the world."""
    w, u = quat[:, :1], quat[:, 1:]
    twice = 2.0 * np.cross(u, vector)
    return vector + w * twice + np.cross(u, twice)
