"""Search for the crawl stance: a constrained optimization over pose and joint angles.

Minimized is a sum of squared preferences over palm pitch, roll, height and 20 joint
angles, subject to the five tip centres one tip radius above the floor. The paper does
not give its stance; every preference and weight here is our choice. Run by
`fingers hand stance`; same seed, same result. The stored stance is that of the default
hand file, seed 0 and 40 starts.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.optimize import OptimizeResult, minimize

from envs.errors import InputError
from envs.hand.hand_file import HandFile
from envs.hand.model import PALM, build_model
from envs.hand.nominal import FINGERS
from envs.hand.spec import TIP_SPHERES
from envs.hand.support import lifted_margins, support_margins

_RANGE_MARGIN_RAD = 0.1
_NEIGHBOURS = ((1, 2), (2, 3), (3, 4), (0, 1), (0, 4))
_STEPS_W = np.array([[0.020, 0.0, 0.0], [0.0, 0.0, 0.015]])  # a step forward, a lift


@dataclass(frozen=True)
class StanceWeights:
    """Weights of the preferences; each is dimensionless, in the scale named.

    Attributes:
        margin: shortfall of the static margin below 30 mm, per 10 mm.
        one_lifted: shortfall of the margin below 10 mm with any one finger lifted, per
            10 mm. Without it the finger that the hand leans on is dragged, not lifted.
        range: distance of each joint from the middle of its range, per range.
        pad: pad normals above 10° below the horizontal, per 30°.
        clearance: shortfall of the other links' height below 20 mm, per 10 mm.
        step: radians that move a tip 20 mm forward or 15 mm up, per 0.5 rad.
        torque: static joint torque, per torque limit.
        spread: shortfall of the distance of neighbouring tips below 24 mm, per 6 mm.
        order: shortfall of the sideways distance from each of the four fingers to the
            next below 12 mm, per 4 mm; fingers do not cross.
        centre: horizontal distance from the footprint's centre to the centre of mass,
            per 20 mm.
        height: shortfall of the palm's lowest corner below 45 mm, per 10 mm.
        roll: palm roll, per 10°.
    """

    margin: float = 10.0
    one_lifted: float = 5.0
    range: float = 1.0
    pad: float = 2.0
    clearance: float = 3.0
    step: float = 1.5
    torque: float = 2.0
    spread: float = 2.0
    order: float = 5.0
    centre: float = 0.5
    height: float = 1.0
    roll: float = 1.0


def search_stance(
    hand: HandFile,
    seed: int = 0,
    starts: int = 40,
    weights: StanceWeights | None = None,
) -> tuple[Float[np.ndarray, "27"], Float[np.ndarray, "20"]]:
    """Finds the best of several local optima: arg min Σ r(x)², tip gaps(x) = 0.

    SLSQP from random starts.

    Args:
        hand: the hand file.
        seed: seed of the starts.
        starts: number of random starts.
        weights: weights of the preferences.

    Returns:
        qpos with the tips at the floor [m, rad], and the joint targets [rad].

    Raises:
        InputError: no start ended with five tips down.

    Source:
        Ours; the paper does not give its stance. SLSQP: D. Kraft, A software package
        for sequential quadratic programming, DFVLR-FB 88-28, 1988.
    """
    problem = StanceProblem(hand, weights or StanceWeights())
    rng = np.random.default_rng(seed)
    results = [problem.solve(problem.random_start(rng)) for _ in range(starts)]
    down = [r for r in results if np.abs(problem.tip_gaps(r.x)).max() < 1e-6]
    if not down:
        raise InputError(
            "stance", "starts", starts, "more starts: none put 5 tips down"
        )
    best = min(down, key=lambda result: result.fun)
    return problem.qpos(best.x), best.x[3:].copy()


class StanceProblem:
    """The optimization problem over x = (pitch, roll, height, 20 joint angles)."""

    def __init__(self, hand: HandFile, weights: StanceWeights):
        self.weights = weights
        self.model = model = build_model(hand)
        self.data = mujoco.MjData(model)
        self.low, self.high = hand.nominal.per_joint("range_rad").T
        self._tip_radius = model.geom_size[[model.geom(n).id for n in TIP_SPHERES], 0]
        self._tips = [model.site(f"{finger}_tip").id for finger in FINGERS]
        self._tip_bodies = model.site_bodyid[self._tips]
        self._links = [
            model.geom(link.body).id
            for link in hand.nominal.links
            if link.capsule and not link.tip
        ]
        self._palm = model.geom(PALM).id

    def random_start(self, rng: np.random.Generator) -> Float[np.ndarray, "23"]:
        """A random pose: q_j ∈ U(range less a margin), pitch ∈ U(−0.9, 0.9) [rad].

        Source:
            Ours.
        """
        inner = 1.5 * _RANGE_MARGIN_RAD
        joints = rng.uniform(self.low + inner, self.high - inner)
        return np.r_[rng.uniform(-0.9, 0.9), rng.uniform(-0.2, 0.2), 0.1, joints]

    def solve(self, start: Float[np.ndarray, "23"]) -> OptimizeResult:
        """Runs SLSQP from one start: arg min Σ r(x)² with tip gaps(x) = 0.

        Args:
            start: pitch, roll [rad], height [m] and 20 joint angles [rad].

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

    def qpos(self, x: Float[np.ndarray, "23"]) -> Float[np.ndarray, "27"]:
        """Generalized position of an x: q = (0, 0, height, quaternion, joint angles).

        Args:
            x: pitch, roll [rad], height [m] and 20 joint angles [rad].

        Source:
            MuJoCo documentation, `mjData.qpos` of a free joint.
        """
        return np.r_[0.0, 0.0, x[2], palm_quat(x[0], x[1]), x[3:]]

    def tip_gaps(self, x: Float[np.ndarray, "23"]) -> Float[np.ndarray, "5"]:
        """Gaps between tip spheres and floor: g = z_tip − radius [m].

        Args:
            x: pitch, roll [rad], height [m] and 20 joint angles [rad].

        Source:
            Ours.
        """
        self._place(x)
        return self.data.site_xpos[self._tips, 2] - self._tip_radius

    def residuals(self, x: Float[np.ndarray, "23"]) -> Float[np.ndarray, " n"]:
        """All preferences r, each = weight × shortfall / scale [1]; cost = Σ r².

        Args:
            x: pitch, roll [rad], height [m] and 20 joint angles [rad].

        Source:
            Ours, see `StanceWeights`.
        """
        self._place(x)
        w, tips = self.weights, self.data.site_xpos[self._tips]
        com = self.data.subtree_com[1]
        jacobians = [self._tip_jacobian(index) for index in range(5)]
        gaps = [np.linalg.norm(tips[i] - tips[j]) for i, j in _NEIGHBOURS]
        parts = [
            w.margin * _short(support_margins(com[:2], tips[:, :2]), 0.030, 0.010),
            w.one_lifted * _short(lifted_margins(com[:2], tips[:, :2]), 0.010, 0.010),
            w.range * (x[3:] - (self.low + self.high) / 2) / (self.high - self.low),
            w.pad * _short(-self._pad_tilt(), np.deg2rad(10), np.deg2rad(30)),
            w.clearance * _short(self._link_heights(), 0.020, 0.010),
            w.step * _step_effort(jacobians) / 0.5,
            w.torque * self._static_torque(jacobians, tips, com) / self._torque_limit(),
            w.spread * _short(np.array(gaps), 0.024, 0.006),
            w.order * _short(-np.diff(tips[1:, 1]), 0.012, 0.004),
            w.centre * (com[:2] - tips[:, :2].mean(0)) / 0.020,
            w.height * _short(np.array([self._palm_height()]), 0.045, 0.010),
            w.roll * np.array([x[1]]) / np.deg2rad(10),
        ]
        return np.concatenate(parts)

    def _place(self, x: np.ndarray) -> None:
        self.data.qpos[:] = self.qpos(x)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)

    def _tip_jacobian(self, index: int) -> Float[np.ndarray, "3 4"]:
        full = np.zeros((3, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, full, None, self._tips[index])
        return full[:, 6 + 4 * index : 10 + 4 * index]

    def _pad_tilt(self) -> Float[np.ndarray, "5"]:
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

    def _torque_limit(self) -> Float[np.ndarray, "20"]:
        return self.model.actuator_forcerange[:, 1]

    def _static_torque(
        self, jacobians: list[np.ndarray], tips: np.ndarray, com: np.ndarray
    ) -> Float[np.ndarray, "20"]:
        """Joint torques of the least-norm vertical forces that carry the weight."""
        balance = np.vstack([np.ones(5), (tips[:, :2] - com[:2]).T])
        weight = self.model.body_mass.sum() * -self.model.opt.gravity[2]
        forces = np.linalg.pinv(balance) @ np.array([weight, 0.0, 0.0])
        return -np.concatenate(
            [j[2] * f for j, f in zip(jacobians, forces, strict=True)]
        )


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


def _step_effort(jacobians: list[np.ndarray]) -> Float[np.ndarray, "10"]:
    """Least joint motion [rad] that makes each step with each tip (damped)."""
    damping = 1e-6 * np.eye(3)
    inverses = [j.T @ np.linalg.inv(j @ j.T + damping) for j in jacobians]
    return np.array([np.linalg.norm(i @ s) for i in inverses for s in _STEPS_W])
