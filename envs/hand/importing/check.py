"""Whether a user's model and our form of it are the same hand."""

import mujoco
import numpy as np
from jaxtyping import Float

from envs.errors import InputError
from envs.hand.hand_file import HandFile
from envs.hand.importing.place import Placed
from envs.hand.model import PALM, build_model
from envs.hand.spec import hand_spec

TIP_ERROR_M = 1e-6
MASS_ERROR_KG = 1e-9
POSES = 20
_PAD_M = 0.01


def check_same(placed: Placed, hand: HandFile) -> None:
    """Checks fingertips at random joint angles, and the mass.

    Raises:
        InputError: they differ by more than a micrometre or a microgram.
    """
    path = placed.custom.path
    error = tip_error_m(placed, hand)
    if not error <= TIP_ERROR_M:
        found = f"fingertips {1000 * error:.3g} mm apart in the two models"
        raise InputError(path, "", found, "a hand whose links hang on hinges alone")
    theirs = sum(placed.model.body_mass[ids].sum() for ids in placed.bodies.values())
    links = hand.nominal.per_joint("mass").sum()
    ours = links + hand.palm_mass.value + hand.payload_mass.value
    if not abs(ours - theirs) <= MASS_ERROR_KG:
        found = f"{theirs:.6g} kg in the model, {ours:.6g} kg carried over"
        raise InputError(path, "", found, "a hand of which all weight is carried over")


def tip_error_m(placed: Placed, hand: HandFile, seed: int = 0) -> float:
    """Largest distance of fingertip and pad in both models at random joint angles.

    The tip and a point 10 mm off it towards the pad are fixed in the user's distal
    bodies at zero angles; then each model moves them by its own kinematics.

    Args:
        placed: the user's model.
        hand: our form of it.
        seed: of the angles, uniform within the joint ranges.
    """
    low, high = hand.nominal.per_joint("range_rad").T
    angles = np.random.default_rng(seed).uniform(low, high, (POSES, len(low)))
    ours, theirs = _Ours(hand), _Theirs(placed, hand)
    return max(float(np.abs(ours.tips(q) - theirs.tips(q)).max()) for q in angles)


class _Ours:
    """Fingertips and pads of our model, in the palm [m] (2 n × 3)."""

    def __init__(self, hand: HandFile):
        self.model = build_model(hand)
        self.sites = hand_spec(self.model).tip_sites
        self.data = mujoco.MjData(self.model)

    def tips(
        self, angles: Float[np.ndarray, " joints"]
    ) -> Float[np.ndarray, "points 3"]:
        self.data.qpos[7:] = angles
        mujoco.mj_kinematics(self.model, self.data)
        sites = [self.data.site(name) for name in self.sites]
        tips = np.array([site.xpos for site in sites])
        pads = tips + [_PAD_M * site.xmat.reshape(3, 3)[:, 0] for site in sites]
        palm = self.data.body(PALM)
        return (np.concatenate([tips, pads]) - palm.xpos) @ palm.xmat.reshape(3, 3)


class _Theirs:
    """The same points of a user's model, in our palm frame."""

    def __init__(self, placed: Placed, hand: HandFile):
        self.placed, self.data = placed, mujoco.MjData(placed.model)
        self.joints = placed.model.jnt_qposadr[placed.joints]
        self.palm = placed.model.body(placed.custom.palm).id
        each = placed.each
        distal = range(each - 1, len(placed.joints), each)
        frames = [placed.link_w(index) for index in distal]
        tips = [np.array(hand.nominal.links[index].tip) for index in distal]
        points = [f.pos + f.mat @ t for f, t in zip(frames, tips, strict=True)]
        pads = [p + _PAD_M * f.mat[:, 0] for f, p in zip(frames, points, strict=True)]
        self.bodies = (
            2 * placed.model.jnt_bodyid[placed.joints][each - 1 :: each].tolist()
        )
        self.points = [
            placed.data.xmat[body].reshape(3, 3).T @ (point - placed.data.xpos[body])
            for body, point in zip(self.bodies, points + pads, strict=True)
        ]

    def tips(
        self, angles: Float[np.ndarray, " joints"]
    ) -> Float[np.ndarray, "points 3"]:
        self.data.qpos[self.joints] = angles
        mujoco.mj_kinematics(self.placed.model, self.data)
        points_w = np.array(
            [
                self.data.xpos[body] + self.data.xmat[body].reshape(3, 3) @ point
                for body, point in zip(self.bodies, self.points, strict=True)
            ]
        )
        mat = self.data.xmat[self.palm].reshape(3, 3)
        in_body = (points_w - self.data.xpos[self.palm]) @ mat
        return (in_body - self.placed.palm.pos) @ self.placed.palm.mat
