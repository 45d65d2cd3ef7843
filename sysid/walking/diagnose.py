"""Names what is wrong with a hand that walks, from a minute of its log.

    diagnosis = diagnose_walk(read_log("walk.parquet"), env)

Every hypothesis of `sysid.walking.hypotheses` is fitted on half of the walk, in
stretches of five seconds, and judged on the other half, and the other way round:

    r = [short walks missed, gyro − turning − b, R g − down(tilt)] / scatter

First all along the tangent at the hand as simulated, then the best few in full. The
friction of the fingertips is fitted along in all of them.
"""

import time
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from envs.actuator.effects.mount_tilt import tilted
from envs.batch import BatchEnv
from sysid.logs.log import MeasuredLog
from sysid.result import Diagnosis
from sysid.search_fit import Search
from sysid.walking.hypotheses import Hypothesis, axes, candidate, hypotheses
from sysid.walking.record import walk_record
from sysid.walking.simulation import LOOKS, PIECE_STEPS, Pieces
from sysid.walking.verdict import BOUND, Judged, verdict_of

STRETCH_S = 5.0
FULL = 3
"""Hypotheses that are fitted in full."""

_PRIOR, _TANGENT, _ROBUST = 10.0, 1.0, 3.0

_FLOOR = 0.3
"""Deviation of parameters, in units of their axes, below which nothing is
believed: short walks start from measured states, whose noise and smoothing bend what
they show (found on walks with known causes)."""

_TOLD = "floor_tilt"
"""Effect that IMU and camera tell together, without any simulation or slope."""


class Walk:
    """Residual of a walk as a function of all parameters."""

    def __init__(self, log: MeasuredLog, env: BatchEnv):
        self.axes = axes()
        self.pieces = Pieces(env, walk_record(log, env))
        record = self.pieces.record
        rows = self.pieces.starts[:, None] + np.arange(PIECE_STEPS)
        self._spin = np.mean((record.gyro - record.turning)[rows], 1)
        self._down = np.mean(_turned(record.qpos[:, 3:7], record.gravity)[rows], 1)
        self.block = (self.pieces.starts * record.dt // STRETCH_S).astype(int)
        self.scale = np.ones(self.width)
        self.scale = np.maximum(_scatter(self.raw(np.zeros(len(self.axes)))), 1e-6)

    @property
    def width(self) -> int:
        """Residuals of one piece."""
        return len(LOOKS) * 26 + 5

    def raw(self, theta: Float[np.ndarray, " a"]) -> Float[np.ndarray, "p w"]:
        """Residuals in their own units."""
        missed = self.pieces.misses(candidate(theta, self.axes))
        values = {
            (a.effect, a.name): a.value(float(x))
            for a, x in zip(self.axes, theta, strict=True)
        }
        bias = [values["imu_bias", f"{a}_rad_s"] for a in "xyz"]
        tilt = [values["floor_tilt", f"{a}_rad"] for a in ("roll", "pitch")]
        down = np.asarray(tilted(jnp.array([0.0, 0.0, -1.0]), *tilt))
        told = [self._spin - bias, (self._down - down)[:, :2]]
        return np.concatenate([missed.reshape(len(missed), -1), *told], 1)

    def residual(self, theta: Float[np.ndarray, " a"]) -> Float[np.ndarray, "p w"]:
        """Residuals over their scatter; large ones grow slowly."""
        return _ROBUST * np.arcsinh(self.raw(theta) / self.scale / _ROBUST)

    def tangent(self, theta: Float[np.ndarray, " a"]) -> Float[np.ndarray, "p w a"]:
        """Its derivative by all parameters."""
        step = _TANGENT * np.eye(len(theta))
        return np.stack(
            [
                (self.residual(theta + s) - self.residual(theta - s)) / (2 * _TANGENT)
                for s in step
            ],
            -1,
        )


def diagnose_walk(
    log: MeasuredLog,
    env: BatchEnv,
    tell: Callable[[str], object] = lambda text: None,
) -> tuple[Diagnosis, list[Judged]]:
    """Compares a walk with the simulation and names the cause of the difference.

    Args:
        log: of a free hand; see `sysid.walking.record.walk_record`.
        env: worlds of a task with the hand of `sysid.walking.hypotheses.whole_hand`.
        tell: hears what is being done.

    Returns:
        The verdict, and the hypotheses that were fitted in full, best first.

    Raises:
        InputError: a log that cannot be used, in one sentence.
    """
    began = time.monotonic()
    tell("simulating the hand as it is")
    walk = Walk(log, env)
    zero = np.zeros(len(walk.axes))
    base, tangent = walk.residual(zero), walk.tangent(zero)
    ranked = sorted(
        hypotheses(walk.axes),
        key=lambda h: -np.sum(_linear_gains(walk, base, tangent, h)),
    )
    null = Hypothesis("", "", ())
    none = np.zeros(int(walk.block.max()) + 1)
    plain = _judged(walk, null, none, np.zeros(1))
    full = []
    for hypothesis in ranked[:FULL]:
        tell(f"fitting {hypothesis.effect} of {hypothesis.where}")
        jac = tangent[..., [0, *hypothesis.indices]]
        every = np.ones(len(walk.block), dtype=bool)
        start = _step(base, jac, every, np.zeros(jac.shape[-1]))
        full.append(_judged(walk, hypothesis, plain.gains, start))
    full.sort(key=lambda judged: -judged.gain)
    count = walk.width * np.bincount(walk.block)
    found = verdict_of(walk.axes, full, plain, count)
    seconds = round(time.monotonic() - began, 3)
    return Diagnosis(**found, log_sha256=(log.sha256,), seed=0, runtime_s=seconds), full


def _linear_gains(walk: Walk, base, tangent, hypothesis: Hypothesis) -> np.ndarray:
    """Held-out gains by stretch of a fit along the tangent."""
    gains = np.zeros(int(walk.block.max()) + 1)
    for side in (0, 1):
        fit = walk.block % 2 == side
        costs = []
        for free in ((0,), (0, *hypothesis.indices)):
            jac = tangent[..., list(free)]
            step = _step(base, jac, fit, np.zeros(len(free)))
            costs.append(_costs(base + jac @ step, walk.block))
        held = np.arange(len(gains)) % 2 != side
        gains[held] = 0.5 * (costs[0] - costs[1])[held]
    return gains


def _judged(
    walk: Walk, hypothesis: Hypothesis, plain: np.ndarray, start: np.ndarray
) -> Judged:
    """Fits in full; without a hypothesis the gains are minus the plain costs.

    The fits of either half take the Jacobian of the fit of the whole, from which they
    are not far.
    """
    free = np.array([0, *hypothesis.indices])
    search, theta = _search(walk, free), np.zeros(len(walk.axes))
    theta[free] = search.solved(start)
    r, jac = (x.reshape(len(walk.block), -1) for x in search.linear(theta[free]))
    jac = jac.reshape(*r.shape, len(free))
    gains = np.zeros(int(walk.block.max()) + 1)
    for side in (0, 1):
        half = theta.copy()
        half[free] += _step(r, jac, walk.block % 2 == side, theta[free])
        held = np.arange(len(gains)) % 2 != side
        gains[held] = -0.5 * _costs(walk.residual(half), walk.block)[held]
    spread, wide = search.spread(theta[free], np.repeat(walk.block, walk.width))
    floor = np.where([walk.axes[i].effect == _TOLD for i in free], 0.0, _FLOOR)
    half = np.zeros(len(theta))
    half[free] = wide * np.hypot(spread, floor)
    return Judged(hypothesis, gains - plain, theta, half)


def _step(r: np.ndarray, jac: np.ndarray, chosen: np.ndarray, at: np.ndarray):
    """Step to the least squares of some pieces."""
    a = jac[chosen].reshape(-1, jac.shape[-1])
    gram = a.T @ a + np.eye(len(at)) / _PRIOR**2
    return -np.linalg.solve(gram, a.T @ r[chosen].ravel() + at / _PRIOR**2)


def _search(walk: Walk, free: Int[np.ndarray, " k"]) -> Search:
    """Least squares over some parameters."""

    def residuals(thetas: np.ndarray) -> np.ndarray:
        whole = np.zeros((len(thetas), len(walk.axes)))
        whole[:, free] = thetas
        return np.stack([walk.residual(theta).ravel() for theta in whole])

    wide = np.full(len(free), BOUND)
    return Search(
        residuals,
        center=np.zeros(len(free)),
        deviation=np.full(len(free), _PRIOR),
        low=-wide,
        high=wide,
        step=_TANGENT,
        rounds=8,
        enough=2.0,
        reach=5.0,
        tried=(0.1,),
        stretched=(0.5, 1.0, 2.5, 6.0),
    )


def _costs(residual: np.ndarray, block: Int[np.ndarray, " p"]) -> np.ndarray:
    """Sum of squares by stretch."""
    return np.bincount(block, np.sum(residual**2, axis=1))


def _scatter(raw: np.ndarray) -> np.ndarray:
    """Robust deviation of every channel around its median."""
    return 1.4826 * np.median(np.abs(raw - np.median(raw, axis=0)), axis=0)


def _turned(quat: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Vectors of the palm frame in the world."""
    w, u = quat[:, :1], quat[:, 1:]
    twice = 2.0 * np.cross(u, vector)
    return vector + w * twice + np.cross(u, twice)
