"""Search for the crawl stance: a constrained optimization over pose and joint angles.

Minimized is a sum of squared preferences over palm pitch, roll, height and joint
angles, subject to the tip centres one tip radius above the floor. The paper does
not give its stance; every preference and weight here is our choice. Run by
`fingers hand stance`; same seed, same result. The stored stance is that of the default
hand file, seed 0 and 40 starts.
"""

from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.optimize import OptimizeResult, minimize

from envs.errors import InputError
from envs.hand.hand_file import HandFile, StanceStart
from envs.hand.model import PALM, build_model
from envs.hand.nominal import NominalHand
from envs.hand.spec import hand_spec
from envs.hand.stance_weights import StanceWeights as StanceWeights
from envs.hand.support import lifted_margins, support_margins

_RANGE_MARGIN_RAD = 0.1
_STEPS_W = np.array([[0.020, 0.0, 0.0], [0.0, 0.0, 0.015]])  # a step forward, a lift


def search_stance(
    hand: HandFile,
    seed: int = 0,
    starts: int = 40,
    weights: StanceWeights | None = None,
    progress: Callable[[int, int], None] = lambda done, starts: None,
) -> tuple[Float[np.ndarray, " nq"], Float[np.ndarray, " joints"]]:
    """Finds the best of several local optima: arg min Σ r(x)², tip gaps(x) = 0.

    SLSQP from random starts.

    Args:
        hand: the hand file.
        seed: seed of the starts.
        starts: number of random starts.
        weights: weights of the preferences.
        progress: called after each start with how many of all are done.

    Returns:
        qpos with the tips at the floor [m, rad], and the joint targets [rad].

    Raises:
        InputError: no start ended with all tips down.

    Source:
        Ours; the paper does not give its stance. SLSQP: D. Kraft, A software package
        for sequential quadratic programming, DFVLR-FB 88-28, 1988.
    """
    problem = StanceProblem(hand, weights or StanceWeights())
    rng = np.random.default_rng(seed)
    results = []
    for done in range(1, starts + 1):
        results.append(problem.solve(problem.random_start(rng)))
        progress(done, starts)
    down = [r for r in results if np.abs(problem.tip_gaps(r.x)).max() < 1e-6]
    if not down:
        valid = f"more starts: none put {len(problem.tips)} tips down"
        raise InputError("stance", "starts", starts, valid)
    best = min(down, key=lambda result: result.fun)
    return problem.qpos(best.x), best.x[3:].copy()


def with_stance(
    hand: HandFile,
    seed: int = 0,
    starts: int = 40,
    progress: Callable[[int, int], None] = lambda done, starts: None,
) -> HandFile:
    """Returns the hand with a stance of its own; see `search_stance`."""
    qpos, target = search_stance(hand, seed, starts, progress=progress)
    targets, start = (tuple(float(f"{v:.9g}") for v in x) for x in (target, qpos))
    return replace(hand, stance=StanceStart(targets, start))


class StanceProblem:
    """The optimization problem over x = (pitch, roll, height, joint angles)."""

    def __init__(self, hand: HandFile, weights: StanceWeights):
        self.weights = weights
        self.model = model = build_model(hand)
        self.data = mujoco.MjData(model)
        self.low, self.high = hand.nominal.per_joint("range_rad").T
        spec = hand_spec(model)
        spheres = [model.geom(name).id for name in spec.tip_spheres]
        self._tip_radius = model.geom_size[spheres, 0]
        self.tips = [model.site(name).id for name in spec.tip_sites]
        self._each = hand.nominal.links_per_finger
        self._neighbours = _neighbours(len(self.tips))
        self._side = _side(model, hand.nominal)
        self._tip_bodies = model.site_bodyid[self.tips]
        self._links = [
            model.geom(link.body).id
            for link in hand.nominal.links
            if link.capsule and not link.tip
        ]
        self._palm = model.geom(PALM).id

    def random_start(self, rng: np.random.Generator) -> Float[np.ndarray, " x"]:
        """A random pose: q_j ∈ U(range less a margin), pitch ∈ U(−0.9, 0.9) [rad].

        Source:
            Ours.
        """
        inner = 1.5 * _RANGE_MARGIN_RAD
        joints = rng.uniform(self.low + inner, self.high - inner)
        return np.r_[rng.uniform(-0.9, 0.9), rng.uniform(-0.2, 0.2), 0.1, joints]

    def solve(self, start: Float[np.ndarray, " x"]) -> OptimizeResult:
        """Runs SLSQP from one start: arg min Σ r(x)² with tip gaps(x) = 0.

        Args:
            start: pitch, roll [rad], height [m] and joint angles [rad].

        Source:
            D. Kraft, A software package for sequential quadratic programming,
            DFVLR-FB 88-28, 1988.
        """
        margin = _RANGE_MARGIN_RAD
        joints = zip(self.low + margin, self.high - margin, strict=True)
        return minimize(
            lambda x: float(np.sum(self.residuals(x) ** 2)),
            start,
            method="SLSQP",
            bounds=[(-1.2, 1.2), (-0.5, 0.5), (0.03, 0.2), *joints],
            constraints={"type": "eq", "fun": lambda x: 100.0 * self.tip_gaps(x)},
            options={"maxiter": 400, "ftol": 1e-7},
        )

    def qpos(self, x: Float[np.ndarray, " x"]) -> Float[np.ndarray, " nq"]:
        """Generalized position of an x: q = (0, 0, height, quaternion, joint angles).

        Args:
            x: pitch, roll [rad], height [m] and joint angles [rad].

        Source:
            MuJoCo documentation, `mjData.qpos` of a free joint.
        """
        return np.r_[0.0, 0.0, x[2], palm_quat(x[0], x[1]), x[3:]]

    def tip_gaps(self, x: Float[np.ndarray, " x"]) -> Float[np.ndarray, " tips"]:
        """Gaps between tip spheres and floor: g = z_tip − radius [m].

        Args:
            x: pitch, roll [rad], height [m] and joint angles [rad].

        Source:
            Ours.
        """
        self._place(x)
        return self.data.site_xpos[self.tips, 2] - self._tip_radius

    def residuals(self, x: Float[np.ndarray, " x"]) -> Float[np.ndarray, " n"]:
        """All preferences r, each = weight × shortfall / scale [1]; cost = Σ r².

        Args:
            x: pitch, roll [rad], height [m] and joint angles [rad].

        Source:
            Ours, see `StanceWeights`.
        """
        self._place(x)
        w, tips = self.weights, self.data.site_xpos[self.tips]
        com = self.data.subtree_com[1]
        jacobians = [self._tip_jacobian(index) for index in range(len(tips))]
        gaps = [np.linalg.norm(tips[i] - tips[j]) for i, j in self._neighbours]
        parts = [
            w.margin * _short(support_margins(com[:2], tips[:, :2]), 0.030, 0.010),
            w.one_lifted * _short(lifted_margins(com[:2], tips[:, :2]), 0.010, 0.010),
            w.range * (x[3:] - (self.low + self.high) / 2) / (self.high - self.low),
            w.pad * _short(-self._pad_tilt(), np.deg2rad(10), np.deg2rad(30)),
            w.clearance * _short(self._link_heights(), 0.020, 0.010),
            w.step * _step_effort(jacobians) / 0.5,
            w.torque * self._static_torque(jacobians, tips, com) / self._torque_limit(),
            w.spread * _short(np.array(gaps), 0.024, 0.006),
            w.order * _short(-self._side * np.diff(tips[1:, 1]), 0.012, 0.004),
            w.centre * (com[:2] - tips[:, :2].mean(0)) / 0.020,
            w.height * _short(np.array([self._palm_height()]), 0.045, 0.010),
            w.roll * np.array([x[1]]) / np.deg2rad(10),
        ]
        return np.concatenate(parts)

    def _place(self, x: np.ndarray) -> None:
        self.data.qpos[:] = self.qpos(x)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)

    def _tip_jacobian(self, index: int) -> Float[np.ndarray, "3 links"]:
        full = np.zeros((3, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, full, None, self.tips[index])
        first = 6 + self._each * index
        return full[:, first : first + self._each]

    def _pad_tilt(self) -> Float[np.ndarray, " tips"]:
        up = self.data.xmat[self._tip_bodies].reshape(-1, 3, 3)[:, 2, 0]
        return np.arcsin(np.clip(up, -1.0, 1.0))

    def _link_heights(self) -> Float[np.ndarray, " links"]:
        ids = self._links
        axis_up = self.data.geom_xmat[ids].reshape(-1, 3, 3)[:, 2, 2]
        radius, half = self.model.geom_size[ids, :2].T
        return self.data.geom_xpos[ids, 2] - np.abs(axis_up) * half - radius

    def _palm_height(self) -> float:
        up = self.data.geom_xmat[self._palm].reshape(3, 3)[2]
        half = np.abs(up) @ self.model.geom_size[self._palm]
        return float(self.data.geom_xpos[self._palm, 2] - half)

    def _torque_limit(self) -> Float[np.ndarray, " joints"]:
        return self.model.actuator_forcerange[:, 1]

    def _static_torque(
        self, jacobians: list[np.ndarray], tips: np.ndarray, com: np.ndarray
    ) -> Float[np.ndarray, " joints"]:
        """Joint torques of the least-norm vertical forces that carry the weight."""
        balance = np.vstack([np.ones(len(tips)), (tips[:, :2] - com[:2]).T])
        weight = self.model.body_mass.sum() * -self.model.opt.gravity[2]
        forces = np.linalg.pinv(balance) @ np.array([weight, 0.0, 0.0])
        return -np.concatenate(
            [j[2] * f for j, f in zip(jacobians, forces, strict=True)]
        )


def _neighbours(fingers: int) -> tuple[tuple[int, int], ...]:
    """Pairs of fingers side by side: the last one and the first two with the thumb."""
    beside = tuple((i, i + 1) for i in range(1, fingers - 1))
    return (*beside, (0, 1), (0, fingers - 1))


def _side(model: mujoco.MjModel, hand: NominalHand) -> float:
    """1 for a right hand, whose index is left of its last finger; else −1."""
    data = mujoco.MjData(model)
    data.qpos[3:7] = palm_quat(0.0, 0.0)
    mujoco.mj_kinematics(model, data)
    bases = hand.links[hand.links_per_finger :: hand.links_per_finger]
    left = data.body(bases[0].body).xpos[1] - data.body(bases[-1].body).xpos[1]
    return 1.0 if left >= 0.0 else -1.0


def palm_quat(pitch_rad: float, roll_rad: float) -> Float[np.ndarray, "4"]:
    """Palm orientation, w x y z: palm side down, fingers forward, then pitch and roll.

    q = q_x(roll) q_y(pitch) q₀. At zero the palm's +x points down and its +z along
    world x; positive pitch lowers the fingers, positive roll raises the thumb side.

    Args:
        pitch_rad: about world y [rad].
        roll_rad: about world x, after it [rad].

    Source:
        Ours.
    """
    quat = np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0])
    for axis, angle in (([0.0, 1.0, 0.0], pitch_rad), ([1.0, 0.0, 0.0], roll_rad)):
        turn, before = np.zeros(4), quat.copy()
        mujoco.mju_axisAngle2Quat(turn, np.array(axis), angle)
        mujoco.mju_mulQuat(quat, turn, before)
    return quat


def _short(values: np.ndarray, wanted: float, scale: float) -> np.ndarray:
    """Shortfall of values below what is wanted, in units of `scale`."""
    return np.maximum(0.0, wanted - values) / scale


def _step_effort(jacobians: list[np.ndarray]) -> Float[np.ndarray, " steps"]:
    """Least joint motion [rad] that makes each step with each tip (damped)."""
    damping = 1e-6 * np.eye(3)
    inverses = [j.T @ np.linalg.inv(j @ j.T + damping) for j in jacobians]
    return np.array([np.linalg.norm(i @ s) for i in inverses for s in _STEPS_W])
