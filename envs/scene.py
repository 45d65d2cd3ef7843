"""The scene of a task: floor and hand, and behind them what the task adds."""

from collections.abc import Callable

import mujoco
import numpy as np

from envs.hand.hand_file import HandFile
from envs.hand.model import build_spec

AddScene = Callable[[mujoco.MjSpec], None]
"""Adds bodies, joints and sensors, but no actuators, behind those of the hand."""


def build_scene(
    hand: HandFile, q_off: tuple[float, ...], add_scene: AddScene
) -> mujoco.MjSpec:
    """Builds the scene of a task.

    Args:
        hand: the hand file.
        q_off: rotation from the palm to V, w x y z.
        add_scene: what the task adds.

    Returns:
        A specification that is ready to `compile()`.
    """
    spec = build_spec(hand, np.array(q_off))
    add_scene(spec)
    _use_general_inertia(spec)
    return spec


def _use_general_inertia(spec: mujoco.MjSpec) -> None:
    """Turns the inertial frames of loose bodies by 90°, their inertia with them.

    C MuJoCo takes the mass matrix of a body whose inertial frame is its own, and that
    hangs on nothing, from the compiler, and would not read a mass that is given per
    world. In another frame the same inertia is read as that of any other body.
    """
    model = spec.compile()
    for simple in np.flatnonzero(model.body_simple[1:]) + 1:
        body = spec.bodies[simple]
        x, y, z = model.body_inertia[simple]
        body.mass, body.ipos = model.body_mass[simple], model.body_ipos[simple]
        body.inertia, body.iquat = [y, x, z], [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]
        body.explicitinertial = True
