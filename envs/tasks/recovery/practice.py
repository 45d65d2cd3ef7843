"""Practice poses: the hand on its way down from the stance; training may start there.

Between a palm that lies flat and the stance there is no way up on which every step
pays, and exploration from fallen poses alone stays with the palm flat. Poses from all
along the way down let the policy learn the last part of the way up first (a reverse
curriculum): some sink from the stance, others tip over toward one of the falls, as a
hand does that stands on its wrist end and throws its fingers forward. They are ours;
the paper names none. `practice.json` beside this module is the result for the
default hand file.
"""

import json
from collections.abc import Callable
from functools import cache, partial
from importlib.resources import files

import mujoco
import numpy as np
from jaxtyping import Float

from envs.errors import InputError
from envs.hand.hand_file import HandFile
from envs.hand.model import build_model
from envs.hand.stance import Stance
from envs.tasks.recovery.falls import (
    OTHER_PER_SIDE,
    Falls,
    load_falls,
    settle_falls,
)
from envs.tasks.recovery.lying import (
    clearance_m,
    curl,
    down_b,
    lie_down,
    rounded,
    turned_down,
)

SINKING, TIPPING = 64, 32
"""Numbers of poses of the two kinds."""

_SEED = 20260122
_REACH_RAD = 1.3
_LEAN_RAD = 1.0
_SINKING_S = (0.02, 2.0)
_MOST_SUNK_RAD = np.deg2rad(70.0)
_TILT_TOLERANCE_RAD = np.deg2rad(5.0)
_DEEPEST_M = 1e-3
_TRIES = 400

Poses = tuple[tuple[float, ...], ...]


@cache
def load_practice() -> Poses:
    """Reads `practice.json` beside this file: generalized positions."""
    text = files("envs.tasks.recovery").joinpath("practice.json").read_text("utf-8")
    return tuple(map(tuple, json.loads(text)))


def practice_of(hand: HandFile, stance: Stance) -> Poses:
    """Practice poses of a hand: the stored ones, simulated anew for another hand.

    Raises:
        InputError: there are no such poses.
    """
    same = hand.sha256 == load_falls().hand_sha256
    return load_practice() if same else settle_practice(hand, stance)


def settle_practice(hand: HandFile, stance: Stance) -> Poses:
    """Simulates the practice poses; deterministic.

    The hand is put down just above the floor and sinks for 0.02 to 2 s (even in the
    logarithm), after which its motion is forgotten. Such draws are repeated until the
    tilt is within 5 degrees of that wanted, which grows from pose to pose, and nothing
    reaches into the floor. `SINKING` poses, up to 70 degrees, begin with joint targets
    up to 1.3 rad from the stance's, leaning by up to 1 rad. `TIPPING` poses, from 70
    degrees to the farthest of `OTHER_PER_SIDE` falls on each side, begin between stance
    and one of these.

    Args:
        hand: the hand file.
        stance: its stance.

    Raises:
        InputError: there is no such pose.
    """
    model, rng = build_model(hand), np.random.default_rng(_SEED)
    draws = [partial(_sink, rng, model, stance)] * SINKING
    falls = settle_falls(hand, stance, OTHER_PER_SIDE)
    level = down_b(np.array(stance.qpos))
    farthest = max(_angle(down_b(np.array(q)), level) for q in falls.qpos)
    draws += [partial(_tip, rng, model, stance, falls)] * TIPPING
    tilts = (
        *np.linspace(0.0, _MOST_SUNK_RAD, SINKING),
        *np.linspace(_MOST_SUNK_RAD, farthest, TIPPING),
    )
    pairs = zip(draws, tilts, strict=True)
    return tuple(_pose(model, level, draw, tilt) for draw, tilt in pairs)


def _pose(
    model: mujoco.MjModel,
    level: Float[np.ndarray, "3"],
    draw: Callable[[], Float[np.ndarray, " nq"]],
    tilt_rad: float,
) -> tuple[float, ...]:
    """Draws until the hand has the tilt and does not reach into the floor."""
    for _ in range(_TRIES):
        qpos = draw()
        near = abs(_angle(down_b(qpos), level) - tilt_rad) < _TILT_TOLERANCE_RAD
        if near and clearance_m(model, qpos) > -_DEEPEST_M:
            return rounded(qpos)
    wanted = f"one at {np.rad2deg(tilt_rad):.0f}° of tilt"
    raise InputError("practice poses", "", f"none in {_TRIES} draws", wanted)


def _sink(
    rng: np.random.Generator, model: mujoco.MjModel, stance: Stance
) -> Float[np.ndarray, " nq"]:
    share, duration_s = rng.uniform(), _draw_duration_s(rng)
    target = _draw_target(rng, model, stance, share)
    joints, quat = curl(model, stance, target), _draw_lean(rng, stance, share)
    return lie_down(model, joints, target, quat, duration_s).qpos


def _tip(
    rng: np.random.Generator, model: mujoco.MjModel, stance: Stance, falls: Falls
) -> Float[np.ndarray, " nq"]:
    k, share = rng.integers(len(falls.side)), rng.uniform()
    over = (1.0 - share) * down_b(np.array(stance.qpos))
    over = over + share * down_b(np.array(falls.qpos[k]))
    share_of_fall = rng.uniform()
    target = (1.0 - share_of_fall) * _draw_target(rng, model, stance, rng.uniform())
    target = target + share_of_fall * np.array(falls.target_rad[k])
    joints, duration_s = curl(model, stance, target), _draw_duration_s(rng)
    return lie_down(model, joints, target, turned_down(over), duration_s).qpos


def _draw_duration_s(rng: np.random.Generator) -> float:
    return float(np.exp(rng.uniform(*np.log(_SINKING_S))))


def _angle(one: Float[np.ndarray, "3"], other: Float[np.ndarray, "3"]) -> float:
    return float(np.arccos(np.clip(one @ other, -1.0, 1.0)))


def _draw_target(
    rng: np.random.Generator, model: mujoco.MjModel, stance: Stance, share: float
) -> Float[np.ndarray, " joints"]:
    away = rng.uniform(-_REACH_RAD, _REACH_RAD, 20)
    return np.clip(np.array(stance.target_rad) + share * away, *model.jnt_range[1:].T)


def _draw_lean(
    rng: np.random.Generator, stance: Stance, share: float
) -> Float[np.ndarray, "4"]:
    """Orientation w x y z near the stance's."""
    turn, quat = np.zeros(4), np.zeros(4)
    axis = rng.normal(size=3)
    angle = share * _LEAN_RAD * rng.uniform()
    mujoco.mju_axisAngle2Quat(turn, axis / np.linalg.norm(axis), angle)
    mujoco.mju_mulQuat(quat, turn, np.array(stance.qpos[3:7]))
    return quat
