"""Fallen poses: the hand on its thumb side or its wrist side, fingers curled.

The paper names the two sides, the curled fingers and a random heading; curl and lean
are drawn here (ours). A pose curls the fingers in free fall, so that they meet each
other as they would, is laid down on its side and settled under its held targets. What
rolls off its side or still moves is drawn anew. `falls.json` beside this
module is the result for the default hand file.
"""

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import mujoco
import numpy as np
from jaxtyping import Float

from envs.errors import InputError
from envs.hand.hand_file import HandFile
from envs.hand.model import FLOOR, PHYSICS_DT_S, build_model
from envs.hand.stance import SETTLE_S, Stance

POSES_PER_SIDE = 16
SIDES = {"thumb": (0.0, 1.0, 0.0), "wrist": (0.0, 0.0, -1.0)}
"""Direction in the palm frame that points down when the hand lies on that side."""

_SEED = 20260121
_TRIES = 400
_CURL_S = 1.5
_LEAN = 0.35
_GAP_M = 0.002
_LEAST_DOWN = {"thumb": 0.85, "wrist": 0.25}
_SLOWEST = 1e-2
_FINGER_CURL = ((0.6, -0.1, 0.6, 0.6), (1.3, 0.1, 1.3, 1.3))
_THUMB_CURL = ((0.3, 0.0, 0.2, 0.2), (1.2, 0.4, 0.9, 0.9))


@dataclass(frozen=True)
class Falls:
    """Settled fallen poses.

    Attributes:
        side: name of the side of each pose, a key of `SIDES`.
        qpos: settled generalized positions (n × 27), above the world's origin.
        target_rad: joint targets that held them (n × 20).
        hand_sha256: digest of the hand file they were settled with.
    """

    side: tuple[str, ...]
    qpos: tuple[tuple[float, ...], ...]
    target_rad: tuple[tuple[float, ...], ...]
    hand_sha256: str


@cache
def load_falls() -> Falls:
    """Reads `falls.json` beside this file."""
    text = files("envs.tasks.recovery").joinpath("falls.json").read_text("utf-8")
    raw = json.loads(text)
    rows = {k: tuple(map(tuple, raw[k])) for k in ("qpos", "target_rad")}
    return Falls(**(raw | rows | {"side": tuple(raw["side"])}))


def falls_of(hand: HandFile, stance: Stance) -> Falls:
    """Fallen poses of a hand: the stored ones, settled anew for another hand.

    Effects do not enter.

    Raises:
        InputError: the hand does not come to rest on one of its sides.
    """
    stored, hand = load_falls(), hand.without_effects
    return stored if hand.sha256 == stored.hand_sha256 else settle_falls(hand, stance)


def settle_falls(hand: HandFile, stance: Stance) -> Falls:
    """Settles `POSES_PER_SIDE` poses on each side; deterministic.

    Args:
        hand: the hand file.
        stance: its stance, from which the fingers curl.

    Raises:
        InputError: the hand does not come to rest on one of its sides.
    """
    model = build_model(hand)
    found = [(side, *pose) for side in SIDES for pose in _poses(model, stance, side)]
    sides, qpos, targets = zip(*found, strict=True)
    return Falls(sides, qpos, targets, hand.sha256)


def clearance_m(model: mujoco.MjModel, qpos: Float[np.ndarray, "27"]) -> float:
    """Least distance of the hand to the floor, d = min over geoms.

    Args:
        model: the scene.
        qpos: generalized position [m, rad].

    Returns:
        Distance [m]; below 0 the hand reaches into the floor.

    Source:
        Ours, by MuJoCo's `mj_geomDistance`.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    floor = model.geom(FLOOR).id
    others = (geom for geom in range(model.ngeom) if geom != floor)
    return min(
        mujoco.mj_geomDistance(model, data, floor, geom, 5.0, None) for geom in others
    )


def down_b(qpos: Float[np.ndarray, "27"]) -> Float[np.ndarray, "3"]:
    """Direction of gravity in the palm frame, g = q* ⊗ (0, 0, −1) ⊗ q.

    Args:
        qpos: generalized position [m, rad], with the orientation q of the palm.

    Returns:
        Unit vector [1].

    Source:
        As `envs.signals.gravity`, in float64.
    """
    down = np.zeros(3)
    mujoco.mju_rotVecQuat(
        down, np.array([0.0, 0.0, -1.0]), qpos[3:7] * np.array([1, -1, -1, -1])
    )
    return down


def _poses(model: mujoco.MjModel, stance: Stance, side: str) -> list[tuple]:
    rng = np.random.default_rng([_SEED, list(SIDES).index(side)])
    poses: list[tuple] = []
    for _ in range(_TRIES):
        target = _draw_curl(rng, model)
        joints = curl(model, stance, target)
        data = lie_down(model, joints, target, _draw_lean(rng, side))
        if _rests_on(side, data):
            poses.append((rounded(data.qpos), rounded(target)))
        if len(poses) == POSES_PER_SIDE:
            return poses
    found = f"{len(poses)} of {_TRIES} falls"
    raise InputError("falls", f"{side} side", found, f"{POSES_PER_SIDE} that rest")


def _draw_curl(
    rng: np.random.Generator, model: mujoco.MjModel
) -> Float[np.ndarray, "20"]:
    fingers = [rng.uniform(*_THUMB_CURL), *rng.uniform(*_FINGER_CURL, size=(4, 4))]
    return np.clip(np.concatenate(fingers), *model.jnt_range[1:].T)


def _draw_lean(rng: np.random.Generator, side: str) -> Float[np.ndarray, "4"]:
    """Orientation w x y z that turns the side, with some lean, downward."""
    return turned_down(np.add(SIDES[side], rng.uniform(-_LEAN, _LEAN, 3)))


def turned_down(axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "4"]:
    """Orientation in which a direction a in the palm frame points down.

    q = (1 − a_z, −a_y, a_x, 0)/‖·‖, the shortest turn of a to −z; a is not +z.

    Args:
        axis: a, of any length > 0 [1].

    Returns:
        Unit quaternion w x y z [1].

    Source:
        The half-way construction: 1 + a·b beside a × b, with b = −z.
    """
    x, y, z = axis / np.linalg.norm(axis)
    quat = np.array([1.0 - z, -y, x, 0.0])
    return quat / np.linalg.norm(quat)


def curl(
    model: mujoco.MjModel, stance: Stance, target: Float[np.ndarray, "20"]
) -> Float[np.ndarray, "20"]:
    """Joint angles after the fingers have curled from the stance, without weight.

    The servos follow θ(t) = θ* + (θ_1 − θ*) min(1, 1.5 t/T), T = 1.5 s.

    Args:
        model: the hand.
        stance: with its joint targets θ*.
        target: joint targets θ_1 at the end [rad].

    Returns:
        Joint angles [rad].

    Source:
        Paper, fall recovery (fingers curled); the motion is ours.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = stance.qpos
    data.qpos[2] = 1.0
    start, steps = np.array(stance.target_rad), round(_CURL_S / PHYSICS_DT_S)
    flags = model.opt.disableflags
    model.opt.disableflags = flags | int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    for step in range(steps):
        data.ctrl[:] = start + (target - start) * min(1.0, 1.5 * step / steps)
        mujoco.mj_step(model, data)
    model.opt.disableflags = flags
    return data.qpos[7:].copy()


def lie_down(
    model: mujoco.MjModel,
    joints: Float[np.ndarray, "20"],
    target: Float[np.ndarray, "20"],
    quat: Float[np.ndarray, "4"],
    duration_s: float = SETTLE_S,
) -> mujoco.MjData:
    """Puts the hand down just above the floor and lets it sink or settle.

    It starts 2 mm above the floor, `clearance_m` = 0.002.

    Args:
        model: the hand on its floor.
        joints: joint angles at the start [rad].
        target: joint targets that are held [rad].
        quat: orientation at the start, w x y z.
        duration_s: time that is simulated [s].

    Returns:
        The state after it, above the world's origin.

    Source:
        Ours.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = [0.0, 0.0, 1.0, *quat, *joints]
    data.qpos[2] -= clearance_m(model, data.qpos) - _GAP_M
    data.ctrl[:] = target
    for _ in range(round(duration_s / PHYSICS_DT_S)):
        mujoco.mj_step(model, data)
    data.qpos[:2] = 0.0
    return data


def _rests_on(side: str, data: mujoco.MjData) -> bool:
    still = np.abs(data.qvel).max() < _SLOWEST
    down = down_b(data.qpos)
    lowest = max(SIDES, key=lambda name: down @ SIDES[name])
    return bool(still and lowest == side and down @ SIDES[side] > _LEAST_DOWN[side])


def rounded(values: Float[np.ndarray, " n"]) -> tuple[float, ...]:
    """Numbers as they are stored, x ← ⌊10⁹ x⌉/10⁹, in their unit ([m], [rad]).

    Source:
        Ours.
    """
    return tuple(round(float(value), 9) for value in values)
