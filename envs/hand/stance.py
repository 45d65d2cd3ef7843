"""The crawl stance: five fingertips down, settled in simulation, and what follows.

The targets come from `envs.hand.stance_search`; `settle` holds them for 4 s with the
payload, as the paper does, and records the pose, the control frame V and the nominal
footprint. `stance.json` beside this module is the result for the default hand file.
"""

import json
from dataclasses import asdict, dataclass
from functools import cache
from importlib.resources import files

import mujoco
import numpy as np
from jaxtyping import Float

from envs.errors import InputError
from envs.hand.hand_file import HandFile
from envs.hand.model import PALM, PHYSICS_DT_S, build_model

SETTLE_S = 4.0


@dataclass(frozen=True)
class Stance:
    """A settled stance.

    Attributes:
        target_rad: joint targets that were held.
        joint_pos_rad: settled joint angles, the reference of the observations.
        root_pos_w: settled palm origin [m], above the world's origin.
        root_quat_w: settled palm orientation, w x y z, V pointing along world x.
        q_off: rotation from the palm to the control frame V, w x y z.
        footprint_v: tip centres relative to the palm origin, in V [m] (n × 3).
        hand_sha256: digest of the hand file it was settled with.
    """

    target_rad: tuple[float, ...]
    joint_pos_rad: tuple[float, ...]
    root_pos_w: tuple[float, ...]
    root_quat_w: tuple[float, ...]
    q_off: tuple[float, ...]
    footprint_v: tuple[tuple[float, ...], ...]
    hand_sha256: str

    @property
    def qpos(self) -> np.ndarray:
        """Settled generalized position."""
        return np.array([*self.root_pos_w, *self.root_quat_w, *self.joint_pos_rad])


@cache
def load_stance(package: str = "envs.hand", name: str = "stance.json") -> Stance:
    """Reads a stored stance, the crawl stance if not given."""
    raw = json.loads(files(package).joinpath(name).read_text("utf-8"))
    lists = {k: tuple(v) for k, v in raw.items() if isinstance(v, list)}
    lists["footprint_v"] = tuple(tuple(tip) for tip in raw["footprint_v"])
    return Stance(**(raw | lists))


def stance_of(hand: HandFile, stored: Stance | None = None) -> Stance:
    """The stance of a hand: its own or the stored one, settled anew for another hand.

    The joint targets are the same; how deep a hand sinks under them depends on its
    mass, stiffness and friction. Effects do not enter: they show as what differs from
    the stance.

    Args:
        hand: the hand file.
        stored: stance of the default hand; the crawl stance if not given.

    Raises:
        InputError: the hand does not stand under these targets.

    Examples:
        >>> from envs.hand.hand_file import load_hand_file
        >>> stance = stance_of(load_hand_file())
        >>> f"palm {1e3 * stance.root_pos_w[2]:.0f} mm above the floor"
        'palm 127 mm above the floor'
        >>> stance.qpos.shape, len(stance.footprint_v)
        ((27,), 5)
    """
    hand = hand.without_effects
    if stored is None and hand.stance:
        return settle(
            hand, np.array(hand.stance.qpos), np.array(hand.stance.target_rad)
        )
    stored = stored or load_stance()
    _check_joints(hand, stored)
    if hand.sha256 == stored.hand_sha256:
        return stored
    return settle(hand, stored.qpos, np.array(stored.target_rad))


def _check_joints(hand: HandFile, stored: Stance) -> None:
    """Refuses a hand that the stored stance cannot be one of."""
    count, wanted = len(hand.nominal.links), len(stored.target_rad)
    if count != wanted:
        valid = f"a stance of its own for {count} joints: the stored one has {wanted}"
        raise InputError("hand file", "stance", "none", valid)


def stance_json(stance: Stance) -> str:
    """The contents of `stance.json`."""
    return json.dumps(asdict(stance), indent=1) + "\n"


def settle(
    hand: HandFile, qpos: Float[np.ndarray, " nq"], target: Float[np.ndarray, " joints"]
) -> Stance:
    """Holds joint targets and records the settled stance: s = s(4 s), max |q̇| < 0.01.

    Args:
        hand: the hand file.
        qpos: start of the settling [m, rad], tips at the floor.
        target: joint targets to hold [rad].

    Raises:
        InputError: the hand falls, or still moves after 4 s.

    Source:
        Paper, settled stance.
    """
    model = build_model(hand)
    data = mujoco.MjData(model)
    data.qpos[:], data.ctrl[:] = qpos, target
    for _ in range(round(SETTLE_S / PHYSICS_DT_S)):
        mujoco.mj_step(model, data)
    _check_settled(data)
    mujoco.mj_forward(model, data)
    return _describe(model, data, target, hand)


def _check_settled(data: mujoco.MjData) -> None:
    fastest = float(np.abs(data.qvel).max())
    if not fastest < 1e-2 or data.qpos[2] < 0.04:
        found = f"speed {fastest:.2g} rad/s, palm at {data.qpos[2]:.3f} m"
        raise InputError("stance", "target_rad", found, "targets that stand still")


def _describe(
    model: mujoco.MjModel, data: mujoco.MjData, target: np.ndarray, hand: HandFile
) -> Stance:
    """Turns the heading of a settled pose to world x and derives V and the footprint.

    V is level in the settled pose; its x is the horizontal direction from the palm to
    the centroid of the distal links of all fingers but the thumb (paper, control
    frame).
    """
    origin = data.body(PALM).xpos.copy()
    nominal = hand.nominal
    forward = [link.body for link in nominal.tip_links[1:]]
    links = np.mean([data.body(name).xpos for name in forward], axis=0)
    heading = np.arctan2(*(links - origin)[[1, 0]])
    unturn = np.array([np.cos(heading / 2), 0.0, 0.0, -np.sin(heading / 2)])
    root = _multiply(unturn, data.qpos[3:7])
    tips = [data.site(f"{finger}_tip").xpos - origin for finger in nominal.fingers]
    return Stance(
        target_rad=_floats(target),
        joint_pos_rad=_floats(data.qpos[7:]),
        root_pos_w=(0.0, 0.0, float(data.qpos[2])),
        root_quat_w=_floats(root),
        q_off=_floats(_conjugate(root)),
        footprint_v=tuple(_floats(_rotate(unturn, tip)) for tip in tips),
        hand_sha256=hand.sha256,
    )


def _floats(values: np.ndarray) -> tuple[float, ...]:
    return tuple(round(float(value), 9) for value in values)


def _multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    out = np.zeros(4)
    mujoco.mju_mulQuat(out, a, b)
    return out


def _conjugate(quat: np.ndarray) -> np.ndarray:
    return quat * np.array([1.0, -1.0, -1.0, -1.0])


def _rotate(quat: np.ndarray, vector: np.ndarray) -> np.ndarray:
    out = np.zeros(3)
    mujoco.mju_rotVecQuat(out, vector, quat)
    return out
