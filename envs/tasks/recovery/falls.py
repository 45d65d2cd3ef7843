"""Fallen poses: the hand on its thumb side or its wrist side, fingers curled.

The paper names the two sides, the curled fingers and a random heading; curl and lean
are drawn here (ours). A pose curls the fingers in free fall, so that they meet each
other as they would, is laid down on its side and settled under its held targets. What
rolls off its side or still moves is drawn anew. `falls.npz` beside this module is the
result for the default hand file: poses to train from, and others, drawn apart, that
training never sees.
"""

from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float

from envs.errors import InputError
from envs.hand.hand_file import HandFile
from envs.hand.model import build_model
from envs.hand.stance import Stance
from envs.tasks.recovery.lying import curl, down_b, lie_down, rounded, turned_down

TRAINING_PER_SIDE, HELD_OUT_PER_SIDE = 180, 90
"""Numbers of the stored poses."""
OTHER_PER_SIDE = 16
"""Number, of either kind, for a hand that has no stored ones: settling takes time."""
SIDES = {"thumb": (0.0, 1.0, 0.0), "wrist": (0.0, 0.0, -1.0)}
"""Direction in the palm frame that points down when the hand lies on that side."""

_SEED, _HELD_OUT_SEED = 20260121, 20261122
_TRIES_A_POSE = 25
_LEAN = 0.35
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
def load_falls(held_out: bool = False) -> Falls:
    """Reads the poses in `falls.npz` beside this file.

    Args:
        held_out: those that training never sees.
    """
    kind = "held_out" if held_out else "training"
    with files("envs.tasks.recovery").joinpath("falls.npz").open("rb") as stream:
        stored = np.load(stream, allow_pickle=False)
        names = tuple(SIDES)
        return Falls(
            side=tuple(names[index] for index in stored[f"{kind}_side"]),
            qpos=_rows(stored[f"{kind}_qpos"]),
            target_rad=_rows(stored[f"{kind}_target_rad"]),
            hand_sha256=str(stored["hand_sha256"]),
        )


def falls_of(hand: HandFile, stance: Stance, held_out: bool = False) -> Falls:
    """Fallen poses of a hand: the stored ones, fewer and settled anew for another hand.

    Effects do not enter.

    Args:
        hand: the hand file.
        stance: its stance.
        held_out: those that training never sees.

    Raises:
        InputError: the hand does not come to rest on one of its sides.
    """
    stored, hand = load_falls(held_out), hand.without_effects
    if hand.sha256 == stored.hand_sha256:
        return stored
    found, wanted = len(stance.target_rad), len(stored.target_rad[0])
    if found != wanted:
        valid = f"a hand of {wanted} joints: the fallen poses are of such a one"
        raise InputError("hand file", "description", f"{found} joints", valid)
    return settle_falls(hand, stance, OTHER_PER_SIDE, held_out)


def settle_falls(
    hand: HandFile, stance: Stance, per_side: int, held_out: bool = False
) -> Falls:
    """Settles poses on each side; deterministic, and more begin with the same ones.

    Args:
        hand: the hand file.
        stance: its stance, from which the fingers curl.
        per_side: number of poses on each side.
        held_out: those that training never sees, drawn with a seed of their own.

    Raises:
        InputError: the hand does not come to rest on one of its sides.
    """
    model, seed = build_model(hand), _HELD_OUT_SEED if held_out else _SEED
    found = [
        (side, *pose)
        for index, side in enumerate(SIDES)
        for pose in _poses(model, stance, side, per_side, [seed, index])
    ]
    sides, qpos, targets = zip(*found, strict=True)
    return Falls(sides, qpos, targets, hand.sha256)


def write_falls(path: Path, hand: HandFile, stance: Stance) -> None:
    """Settles the poses of the default hand and writes the file that is stored."""
    arrays: dict[str, np.ndarray] = {"hand_sha256": np.array(hand.sha256)}
    for kind, number in (
        ("training", TRAINING_PER_SIDE),
        ("held_out", HELD_OUT_PER_SIDE),
    ):
        falls = settle_falls(hand, stance, number, kind == "held_out")
        sides = [list(SIDES).index(side) for side in falls.side]
        arrays[f"{kind}_side"] = np.array(sides, np.uint8)
        arrays[f"{kind}_qpos"] = np.array(falls.qpos, np.float32)
        arrays[f"{kind}_target_rad"] = np.array(falls.target_rad, np.float32)
    np.savez_compressed(path, allow_pickle=False, **arrays)


def _rows(values: Float[np.ndarray, "n k"]) -> tuple[tuple[float, ...], ...]:
    """Returns stored rows as numbers, as `rounded` leaves them."""
    return tuple(map(rounded, values.astype(float)))


def _poses(
    model: mujoco.MjModel, stance: Stance, side: str, number: int, seed: list[int]
) -> list[tuple]:
    rng = np.random.default_rng(seed)
    poses: list[tuple] = []
    for _ in range(tries := _TRIES_A_POSE * number):
        target = _draw_curl(rng, model)
        joints = curl(model, stance, target)
        data = lie_down(model, joints, target, _draw_lean(rng, side))
        if _rests_on(side, data):
            poses.append((rounded(data.qpos), rounded(target)))
        if len(poses) == number:
            return poses
    found = f"{len(poses)} of {tries} falls"
    raise InputError("falls", f"{side} side", found, f"{number} that rest")


def _draw_curl(
    rng: np.random.Generator, model: mujoco.MjModel
) -> Float[np.ndarray, " joints"]:
    fingers = [rng.uniform(*_THUMB_CURL), *rng.uniform(*_FINGER_CURL, size=(4, 4))]
    return np.clip(np.concatenate(fingers), *model.jnt_range[1:].T)


def _draw_lean(rng: np.random.Generator, side: str) -> Float[np.ndarray, "4"]:
    """Orientation w x y z that turns the side, with some lean, downward."""
    return turned_down(np.add(SIDES[side], rng.uniform(-_LEAN, _LEAN, 3)))


def _rests_on(side: str, data: mujoco.MjData) -> bool:
    still = np.abs(data.qvel).max() < _SLOWEST
    down = down_b(data.qpos)
    lowest = max(SIDES, key=lambda name: down @ SIDES[name])
    return bool(still and lowest == side and down @ SIDES[side] > _LEAST_DOWN[side])
