"""Practice poses: the hand sinking from its stance; training may start from them.

Between a palm that lies flat and the stance there is no way up on which every step
pays, and exploration from fallen poses alone stays with the palm flat. Poses from all
along the way down let the policy learn the last part of the way up first (a reverse
curriculum). They are ours; the paper names none. `recovery_practice.json` beside this
module is the result for the default hand file.
"""

import json
from functools import cache
from importlib.resources import files

import mujoco
import numpy as np

from envs.errors import InputError
from envs.hand.hand_file import HandFile
from envs.hand.model import build_model
from envs.hand.stance import Stance
from envs.recovery_falls import (
    clearance_m,
    curl,
    down_b,
    lie_down,
    load_falls,
    rounded,
)

POSES = 64
_SEED = 20260122
_REACH_RAD = 1.3
_LEAN_RAD = 1.0
_SINKING_S = (0.02, 2.0)
_MOST_TILT_RAD = np.deg2rad(70.0)
_TILT_TOLERANCE_RAD = np.deg2rad(5.0)
_DEEPEST_M = 1e-3
_TRIES = 400

Poses = tuple[tuple[float, ...], ...]


@cache
def load_practice() -> Poses:
    """Reads `recovery_practice.json` beside this file: generalized positions."""
    text = files("envs").joinpath("recovery_practice.json").read_text("utf-8")
    return tuple(map(tuple, json.loads(text)))


def practice_of(hand: HandFile, stance: Stance) -> Poses:
    """Practice poses of a hand: the stored ones, simulated anew for another hand.

    Raises:
        InputError: there are no such poses.
    """
    same = hand.sha256 == load_falls().hand_sha256
    return load_practice() if same else settle_practice(hand, stance)


def practice_json(poses: Poses) -> str:
    """The contents of `recovery_practice.json`, one pose a line."""
    rows = ",\n ".join(json.dumps(row) for row in poses)
    return f"[\n {rows}\n]\n"


def settle_practice(hand: HandFile, stance: Stance) -> Poses:
    """Simulates `POSES` poses; deterministic.

    The hand has its joint targets up to 1.3 rad from the stance's, leans by up to 1 rad
    from the stance's orientation, is put down just above the floor and sinks for 0.02
    to 2 s (even in the logarithm), after which its motion is forgotten. Such draws are
    repeated until the tilt is within 5 degrees of that wanted, which grows from pose to
    pose up to 70 degrees, and nothing reaches into the floor.

    Args:
        hand: the hand file.
        stance: its stance.

    Raises:
        InputError: there is no such pose.
    """
    model, rng = build_model(hand), np.random.default_rng(_SEED)
    level = down_b(np.array(stance.qpos))
    poses = []
    for wanted in np.linspace(0.0, _MOST_TILT_RAD, POSES):
        for _ in range(_TRIES):
            qpos = _sink(rng, model, stance)
            tilt = np.arccos(np.clip(down_b(qpos) @ level, -1.0, 1.0))
            near = abs(tilt - wanted) < _TILT_TOLERANCE_RAD
            if near and clearance_m(model, qpos) > -_DEEPEST_M:
                poses.append(rounded(qpos))
                break
    if len(poses) < POSES:
        raise InputError("practice poses", "", f"{len(poses)} poses", f"{POSES}")
    return tuple(poses)


def _sink(
    rng: np.random.Generator, model: mujoco.MjModel, stance: Stance
) -> np.ndarray:
    share, duration_s = rng.uniform(), np.exp(rng.uniform(*np.log(_SINKING_S)))
    target = _draw_target(rng, model, stance, share)
    joints, quat = curl(model, stance, target), _draw_lean(rng, stance, share)
    return lie_down(model, joints, target, quat, duration_s).qpos


def _draw_target(
    rng: np.random.Generator, model: mujoco.MjModel, stance: Stance, share: float
) -> np.ndarray:
    away = rng.uniform(-_REACH_RAD, _REACH_RAD, 20)
    return np.clip(np.array(stance.target_rad) + share * away, *model.jnt_range[1:].T)


def _draw_lean(rng: np.random.Generator, stance: Stance, share: float) -> np.ndarray:
    """Orientation w x y z near the stance's."""
    turn, quat = np.zeros(4), np.zeros(4)
    axis = rng.normal(size=3)
    angle = share * _LEAN_RAD * rng.uniform()
    mujoco.mju_axisAngle2Quat(turn, axis / np.linalg.norm(axis), angle)
    mujoco.mju_mulQuat(quat, turn, np.array(stance.qpos[3:7]))
    return quat
